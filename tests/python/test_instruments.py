# SPDX-License-Identifier: MIT
"""mpf.Serial and mpf.Gpib with the servers of MPF: a terminal line, and a bus of models."""

from __future__ import annotations

import math
import os
import threading
import time
import tty
from collections.abc import Callable, Iterator

import pytest
from conftest import PATIENCE, PROGRAMS, Silent

import mpf


class Line:
    """The far end of a terminal line: answers VOLT? and is silent otherwise."""

    def __init__(self) -> None:
        self.end, near = os.openpty()
        tty.setraw(near)
        self.device = os.ttyname(near)
        self._near = near
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        asked = b""
        while True:
            try:
                asked += os.read(self.end, 100)
            except OSError:
                return
            while b"\r" in asked:
                question, asked = asked.split(b"\r", 1)
                if question == b"VOLT?":
                    os.write(self.end, b"+1.25\r")

    def close(self) -> None:
        os.close(self._near)
        os.close(self.end)


@pytest.fixture
def line() -> Iterator[Line]:
    line = Line()
    yield line
    line.close()


@pytest.fixture
def meter(line: Line, start: Callable[..., object]) -> Iterator[mpf.Serial]:
    start(PROGRAMS / "mpf-serial-server", "meter", line.device, "--log-level", "error")
    with mpf.Serial("meter", timeout=PATIENCE, queue_timeout=PATIENCE) as meter:
        yield meter


def test_a_query_writes_and_reads(meter: mpf.Serial) -> None:
    assert meter.query("VOLT?\r") == b"+1.25\r"


def test_a_write_and_a_read_may_be_separate(meter: mpf.Serial) -> None:
    meter.write(b"VOLT?\r")
    assert meter.read() == b"+1.25\r"


def test_an_end_of_message_may_be_given(meter: mpf.Serial) -> None:
    assert meter.query("VOLT?\r", eom=b".") == b"+1."


def test_a_silent_instrument_is_a_timeout(meter: mpf.Serial) -> None:
    with pytest.raises(mpf.InstrumentTimeout, match="no complete answer in time") as failure:
        meter.query("CURR?\r", timeout=0.01)
    assert failure.value.answer == b""
    assert isinstance(failure.value, TimeoutError)
    assert meter.query("VOLT?\r") == b"+1.25\r"


def test_the_line_may_be_configured(meter: mpf.Serial) -> None:
    meter.configure(baud=19200)
    assert meter.query("VOLT?\r") == b"+1.25\r"


@pytest.fixture
def bus(start: Callable[..., object]) -> None:
    start(PROGRAMS / "mpf-gpib-server", "GPIB0", "a-ip488", "4096", "20", "--carrier",
          "ipac=model", "--ti9914", "a-ip488,ipac,IP_a,105", "--log-level", "error")


def test_a_gpib_instrument(bus: None) -> None:
    with mpf.Gpib("GPIB0", 22, timeout=PATIENCE, queue_timeout=PATIENCE) as meter:
        assert meter.query("ID?\n").startswith(b"HP3458A")
        assert 0 <= meter.poll() <= 255
        assert meter.lease(1, "test") > 0
        meter.unlease()
        meter.clear()
        meter.trigger()


def test_an_absent_gpib_instrument_is_an_error(bus: None) -> None:
    with mpf.Gpib("GPIB0", 5, timeout=PATIENCE, queue_timeout=PATIENCE) as nobody:
        with pytest.raises(mpf.InstrumentError, match="no instrument accepts bytes"):
            nobody.write("ID?\n")


@pytest.mark.parametrize("act", [lambda meter: meter.query("VOLT?\r"), lambda meter: meter.flush(),
                                 lambda meter: meter.configure(baud=9600)])
def test_an_absent_server_is_an_error_whatever_the_instrument_may_take(
    act: Callable[[mpf.Serial], object],
) -> None:
    for longest in (1e6, math.inf, -math.inf):
        with mpf.Serial("nobody", timeout=longest, queue_timeout=0.01) as meter:
            with pytest.raises(mpf.NotConnected, match="nobody"):
                act(meter)


def test_nan_is_not_a_time() -> None:
    with mpf.Serial("nobody") as meter, pytest.raises(ValueError, match="timeout: NaN"):
        meter.query("VOLT?\r", timeout=math.nan)


def test_a_negative_time_of_an_instrument_leaves_that_of_the_queue(server: mpf.Server) -> None:
    server.on(mpf.Char8Array)(lambda request: f"{request.timeout} ms")
    with server.start(), mpf.Serial("tested", queue_timeout=PATIENCE) as meter:
        for timeout in (-math.inf, -2 * PATIENCE):
            assert meter.query("VOLT?\r", timeout=timeout) == b"1 ms"


class LateClient:
    """Stands for a client whose server is absent for three seconds."""

    def __init__(self, pass_time: Callable[[float], None]) -> None:
        self.limits: list[float] = []
        self._pass_time = pass_time

    def wait_connected(self, timeout: float) -> bool:
        self._pass_time(3.0)
        return True

    def call(self, request: mpf.Message, timeout: float, **options: object) -> mpf.Char8Array:
        self.limits.append(timeout)
        return mpf.Char8Array(b"+1.25")


def test_both_times_begin_before_the_wait_for_the_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = 100.0

    def pass_time(seconds: float) -> None:
        nonlocal now
        now += seconds

    late = LateClient(pass_time)
    with mpf.Serial("meter", timeout=2.0, queue_timeout=4.0) as meter:
        with monkeypatch.context() as changed:
            changed.setattr(meter, "client", late)
            changed.setattr(time, "monotonic", lambda: now)
            assert meter.query("VOLT?\r") == b"+1.25"

    assert late.limits == [3.0]  # of six seconds


def test_an_operation_that_waits_for_others_expires(silent: Silent) -> None:
    with mpf.Serial("silent", timeout=PATIENCE, queue_timeout=PATIENCE) as meter:
        assert meter.client.wait_connected(PATIENCE)
        meter.queue_timeout = 0.01

        with pytest.raises((mpf.Expired, mpf.TimedOut)):
            meter.write("VOLT?\r", timeout=0.01)
