# SPDX-License-Identifier: MIT
"""Programs of PyVISA reach instruments behind the servers of MPF."""

from __future__ import annotations

import os
import termios
from collections.abc import Callable, Iterator

import pytest
import pyvisa
from conftest import PATIENCE, PROGRAMS
from test_instruments import Line, bus, line
from pyvisa.constants import BufferOperation, ControlFlow, Parity, StatusCode, StopBits
from pyvisa.errors import VisaIOError
from pyvisa.resources import Resource

import mpf

__all__ = ["bus", "line"]  # fixtures
READY, DATA_AVAILABLE = 0x10, 0x80  # status bits of the meter


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
    overflow = mpf.InstrumentError("overflow", mpf.Char8Array(b"x" * 1000, status=2))
    parts = [overflow, b"y" * 499 + b"\r"]

    def read(**_: object) -> bytes:
        part = parts.pop(0)
        if isinstance(part, Exception):
            raise part
        return part

    session = resources.visalib._sessions[meter.session]
    monkeypatch.setattr(session.instrument, "read", read)
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


def test_flush_discards_what_its_mask_says(
    meter: pyvisa.resources.SerialInstrument, line: Line
) -> None:
    meter.write("VOLT?")
    assert meter.read_bytes(3) == b"+1."
    meter.flush(BufferOperation.flush_write_buffer)
    assert meter.read() == "25"

    meter.write("VOLT?")
    assert meter.read_bytes(3) == b"+1."
    meter.flush(BufferOperation.discard_read_buffer)
    os.write(line.end, b"+2.5\r")
    assert meter.read() == "+2.5"


CFLAG, SPEED = 2, 4  # in the result of tcgetattr()


@pytest.mark.parametrize(
    ("attribute", "value", "index", "bits", "expected"),
    [
        ("baud_rate", 19200, SPEED, ~0, termios.B19200),
        ("stop_bits", StopBits.two, CFLAG, termios.CSTOPB, termios.CSTOPB),
        ("flow_control", ControlFlow.rts_cts, CFLAG, termios.CRTSCTS, termios.CRTSCTS),
    ],
)
def test_the_line_may_be_configured(
    meter: pyvisa.resources.SerialInstrument,
    line: Line,
    attribute: str,
    value: int,
    index: int,
    bits: int,
    expected: int,
) -> None:
    setattr(meter, attribute, value)
    assert getattr(meter, attribute) == value
    setting = termios.tcgetattr(line.end)[index]
    assert isinstance(setting, int)
    assert setting & bits == expected


@pytest.mark.parametrize(
    ("attribute", "value", "expected"),
    [
        ("data_bits", 7, {"bits_per_char": 7}),
        ("parity", Parity.odd, {"parity": "O"}),
        ("parity", Parity.even, {"parity": "E"}),
        ("parity", Parity.none, {"parity": "N"}),
    ],
)
def test_settings_that_a_pseudo_terminal_does_not_have(
    resources: pyvisa.ResourceManager,
    meter: pyvisa.resources.SerialInstrument,
    monkeypatch: pytest.MonkeyPatch,
    attribute: str,
    value: int,
    expected: dict[str, object],
) -> None:
    settings: dict[str, object] = {}
    session = resources.visalib._sessions[meter.session]
    monkeypatch.setattr(session.instrument, "configure", lambda **given: settings.update(given))
    setattr(meter, attribute, value)
    assert settings == expected


def test_a_setting_that_the_server_does_not_have_is_refused(
    meter: pyvisa.resources.SerialInstrument,
) -> None:
    with pytest.raises(VisaIOError) as failure:
        meter.stop_bits = StopBits.one_and_a_half
    assert failure.value.error_code == StatusCode.error_nonsupported_attribute_state


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
    assert meter.read_stb() == READY
    meter.write("TRIG HOLD")
    meter.assert_trigger()
    assert meter.read_stb() == READY | DATA_AVAILABLE
    meter.flush(BufferOperation.discard_receive_buffer)
    assert meter.read_stb() == READY | DATA_AVAILABLE
    meter.clear()
    assert meter.read_stb() == READY
    meter.close()
    absent = resources.open_resource("MPF::GPIB0::5::INSTR")
    never_late(resources, absent)
    with pytest.raises(VisaIOError) as failure:
        absent.write("ID?")
    assert failure.value.error_code == StatusCode.error_no_listeners


@pytest.mark.parametrize(
    "name",
    [
        "USB::1::INSTR",
        "MPF-::x::INSTR",
        "MPF99999999999::x::INSTR",
        "MPF\u0663::x::INSTR",
        "MPF::x::31::INSTR",
        "MPF::x::99999999999999999999::INSTR",
        "MPF::x::5::31::INSTR",
    ],
)
def test_a_name_of_another_kind_is_refused(resources: pyvisa.ResourceManager, name: str) -> None:
    with pytest.raises(VisaIOError) as failure:
        resources.open_resource(name)
    assert failure.value.error_code == StatusCode.error_invalid_resource_name


def test_numbers_of_a_name_may_be_the_largest_ones(resources: pyvisa.ResourceManager) -> None:
    for name in ("MPF-2147483648::x::INSTR", "MPF2147483647::x::30::30::INSTR"):
        resources.open_resource(name).close()
