# SPDX-License-Identifier: MIT
"""Programs of PyVISA reach instruments behind the servers of MPF."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
import pyvisa
from conftest import PATIENCE, PROGRAMS
from test_instruments import Line, bus, line
from pyvisa.constants import StatusCode
from pyvisa.errors import VisaIOError
from pyvisa.resources import Resource

__all__ = ["bus", "line"]  # fixtures


def never_late(resources: pyvisa.ResourceManager, opened: Resource) -> None:
    """Waits as long as it must for the server."""
    opened.timeout = PATIENCE * 1000
    resources.visalib._sessions[opened.session].instrument.queue_timeout = PATIENCE


@pytest.fixture
def resources() -> Iterator[pyvisa.ResourceManager]:
    manager = pyvisa.ResourceManager("@mpf")
    yield manager
    manager.close()


@pytest.fixture
def meter(
    resources: pyvisa.ResourceManager, line: Line, start: Callable[..., object]
) -> Iterator[pyvisa.resources.SerialInstrument]:
    start(PROGRAMS / "mpf-serial-server", "voltmeter", line.device, "--log-level", "error")
    meter = resources.open_resource("MPF::voltmeter::INSTR")
    assert isinstance(meter, pyvisa.resources.SerialInstrument)
    never_late(resources, meter)
    meter.read_termination = meter.write_termination = "\r"
    yield meter
    meter.close()


def test_a_query_has_an_answer(meter: pyvisa.resources.SerialInstrument) -> None:
    assert meter.query("VOLT?") == "+1.25"
    assert meter.query_ascii_values("VOLT?") == [1.25]


def test_an_answer_may_be_read_in_parts(meter: pyvisa.resources.SerialInstrument) -> None:
    meter.write("VOLT?")
    assert meter.read_bytes(3) == b"+1."
    assert meter.read() == "25"


@pytest.mark.parametrize("chunk_size", [300, 20480])
def test_an_answer_may_be_longer_than_the_buffer_of_the_server(
    resources: pyvisa.ResourceManager,
    meter: pyvisa.resources.SerialInstrument,
    monkeypatch: pytest.MonkeyPatch,
    chunk_size: int,
) -> None:
    """The server returns such an answer in parts, if it is reading when the bytes arrive."""
    parts = [(b"x" * 1000, False), (b"y" * 499 + b"\r", True)]
    session = resources.visalib._sessions[meter.session]
    monkeypatch.setattr(session, "_receive", lambda: parts.pop(0))
    meter.chunk_size = chunk_size

    assert meter.read_raw() == b"x" * 1000 + b"y" * 499 + b"\r"


def test_a_silent_instrument_is_a_timeout(meter: pyvisa.resources.SerialInstrument) -> None:
    meter.timeout = 20
    with pytest.raises(VisaIOError) as failure:
        meter.query("CURR?")
    assert failure.value.error_code == StatusCode.error_timeout
    meter.timeout = PATIENCE * 1000
    meter.clear()
    assert meter.query("VOLT?") == "+1.25"


def test_the_line_may_be_configured(meter: pyvisa.resources.SerialInstrument) -> None:
    meter.baud_rate = 19200
    assert meter.baud_rate == 19200
    assert meter.query("VOLT?") == "+1.25"


def test_serial_servers_are_listed(
    resources: pyvisa.ResourceManager, meter: pyvisa.resources.SerialInstrument
) -> None:
    meter.query("VOLT?")
    assert resources.list_resources() == ("MPF0::voltmeter::INSTR",)


def test_a_gpib_instrument(resources: pyvisa.ResourceManager, bus: None) -> None:
    meter = resources.open_resource("MPF::GPIB0::22::INSTR")
    assert isinstance(meter, pyvisa.resources.GPIBInstrument)
    never_late(resources, meter)
    assert meter.query("ID?").startswith("HP3458A")
    assert 0 <= meter.read_stb() <= 255
    meter.assert_trigger()
    meter.close()
    absent = resources.open_resource("MPF::GPIB0::5::INSTR")
    never_late(resources, absent)
    with pytest.raises(VisaIOError) as failure:
        absent.write("ID?")
    assert failure.value.error_code == StatusCode.error_no_listeners


def test_a_name_of_another_kind_is_refused(resources: pyvisa.ResourceManager) -> None:
    with pytest.raises(VisaIOError) as failure:
        resources.open_resource("USB::1::INSTR")
    assert failure.value.error_code == StatusCode.error_invalid_resource_name
