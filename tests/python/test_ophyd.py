# SPDX-License-Identifier: MIT
"""Bluesky reaches servers of MPF through the signals of mpf.ophyd."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import numpy as np
import pytest
from bluesky import RunEngine
from conftest import PATIENCE
from ophyd_async.core import (
    Array1D,
    NotConnectedError,
    StandardReadable,
    StrictEnum,
    init_devices,
    observe_value,
)

import mpf
from mpf.ophyd import (
    mpf_disconnect,
    mpf_signal_r,
    mpf_signal_rw,
    mpf_signal_w,
    mpf_triggerable_command,
)

READ, WRITE = 1, 2


class Range(StrictEnum):
    LOW = "low"
    HIGH = "high"


class Dac(mpf.Server):
    """A value of each kind; WRITE changes it, READ returns it."""

    def __init__(self) -> None:
        super().__init__("dac")
        self.values: dict[type[mpf.Message], Any] = {
            mpf.Int32: 0,
            mpf.Float64: 1.5,
            mpf.Char8Array: "idle",
            mpf.Float64Array: np.arange(3.0),
        }
        for kind in self.values:
            self.on(kind)(self.access)
        self.on(mpf.OutOfBand)(self.ticks)

    def access(self, request: Any) -> object:
        kind = type(request)
        if request.cmd == WRITE:
            if request.address == 9:
                raise mpf.StatusError("channel 9 is broken", status=-9)
            value = request.value
            self.values[kind] = value.copy() if isinstance(value, np.ndarray) else value
        reply = kind(self.values[kind])
        reply.time_stamp_ns = 1_700_000_000_500_000_000
        return reply

    async def ticks(self, request: mpf.OutOfBand) -> AsyncIterator[mpf.Float64]:
        for number in range(1000):
            yield mpf.Float64(number)
            await asyncio.sleep(0.01)


@pytest.fixture
def engine() -> Iterator[RunEngine]:
    """With an event loop that ends."""
    engine = RunEngine()
    yield engine
    engine.loop.call_soon_threadsafe(mpf_disconnect)
    engine.loop.call_soon_threadsafe(engine.loop.stop)
    engine._th.join()
    engine.loop.close()


@pytest.fixture
def dac() -> Iterator[Dac]:
    server = Dac()
    with server.start():
        yield server


def voltage(**options: Any) -> Any:
    return mpf_signal_rw(
        float, "dac", mpf.Float64(cmd=READ), mpf.Float64(cmd=WRITE), name="voltage", **options
    )


async def connected(signal: Any) -> Any:
    await signal.connect(timeout=PATIENCE)
    return signal


@pytest.mark.parametrize(
    ("datatype", "kind", "value"),
    [
        (float, mpf.Float64, 2.5),
        (int, mpf.Int32, 7),
        (bool, mpf.Int32, True),
        (Range, mpf.Int32, Range.HIGH),
        (str, mpf.Char8Array, "running"),
        (Array1D[np.float64], mpf.Float64Array, np.arange(4.0)),
    ],
)
async def test_each_kind_of_value(dac: Dac, datatype: Any, kind: Any, value: Any) -> None:
    signal = mpf_signal_rw(
        datatype, "dac", kind(cmd=READ), kind(cmd=WRITE), name="signal", timeout=PATIENCE
    )
    await connected(signal)
    await signal.set(value)
    found = await signal.get_value()
    assert np.array_equal(found, value)
    assert type(found) is type(value)
    assert (await signal.describe())["signal"]["source"].startswith("mpf://dac/")


async def test_a_reading_has_the_time_stamp_of_the_server(dac: Dac) -> None:
    signal = await connected(voltage(units="V", precision=3))
    reading = (await signal.read())["voltage"]
    assert reading["value"] == 1.5
    assert reading["timestamp"] == 1_700_000_000.5
    description = (await signal.describe())["voltage"]
    assert (description["dtype"], description["units"]) == ("number", "V")


async def test_the_setpoint_is_the_last_value_written(dac: Dac) -> None:
    signal = await connected(voltage())
    assert (await signal.locate())["setpoint"] == 1.5
    await signal.set(2.0)
    dac.values[mpf.Float64] = 1.9
    assert await signal.locate() == {"setpoint": 2.0, "readback": 1.9}


async def test_an_error_of_the_server_reaches_the_caller(dac: Dac) -> None:
    signal = await connected(mpf_signal_w(int, "dac", mpf.Int32(cmd=WRITE, address=9)))
    with pytest.raises(mpf.StatusError, match="channel 9 is broken"):
        await signal.set(1)


async def test_a_command_is_executed(dac: Dac) -> None:
    command = mpf_triggerable_command("dac", mpf.Int32(42, cmd=WRITE))
    await command.connect(timeout=PATIENCE)
    await command.trigger()
    assert dac.values[mpf.Int32] == 42


@pytest.mark.parametrize("access", ["get_value", "set", "trigger"])
async def test_an_access_without_a_server_says_so(access: str) -> None:
    with Dac().start():
        signal = mpf_signal_rw(
            float, "dac", mpf.Float64(cmd=READ), mpf.Float64(cmd=WRITE), timeout=PATIENCE
        )
        command = mpf_triggerable_command("dac", mpf.Int32(), timeout=PATIENCE)
        await signal.connect()
        await command.connect()
    for one in (signal, command):
        one._connector.backend._server._patience = 0.01  # type: ignore[attr-defined]
    while signal._connector.backend._server.client().connected:  # type: ignore[attr-defined]
        await asyncio.sleep(0)

    with pytest.raises(NotConnectedError, match="the server dac is absent"):
        if access == "trigger":
            await command.trigger()
        else:
            await (signal.get_value() if access == "get_value" else signal.set(2.0))
    mpf_disconnect()


async def test_an_absent_server_is_named() -> None:
    with pytest.raises(NotConnectedError, match="dac is absent"):
        await voltage().connect(timeout=0.05)


async def test_a_reply_of_another_type_is_found_when_it_connects(dac: Dac) -> None:
    signal = mpf_signal_r(float, "dac", mpf.Int32(cmd=READ))
    with pytest.raises(NotConnectedError, match=r"the reply is Int32\(value=0\)"):
        await signal.connect(timeout=PATIENCE)


async def test_a_type_without_a_message_is_refused() -> None:
    with pytest.raises(TypeError, match="no message has a value of type"):
        mpf_signal_r(complex, "dac", mpf.Int32())  # type: ignore[type-var]


async def test_values_are_observed(dac: Dac) -> None:
    signal = await connected(voltage(subscribe=mpf.OutOfBand()))
    found = []
    async for value in observe_value(signal):
        found.append(value)
        if len(found) == 3:
            break
    assert found == [0.0, 1.0, 2.0]


async def test_an_error_of_a_callback_is_logged(
    dac: Dac, caplog: pytest.LogCaptureFixture
) -> None:
    signal = await connected(voltage(subscribe=mpf.OutOfBand()))
    found: asyncio.Queue[float] = asyncio.Queue()

    def show(reading: dict[str, Any]) -> None:
        found.put_nowait(reading["value"])
        raise ValueError("broken display")

    backend = signal._connector.backend
    backend.set_callback(show)
    assert [await found.get() for _ in range(3)] == [0.0, 1.0, 2.0]
    backend.set_callback(None)
    assert "broken display" in caplog.text
    caplog.clear()  # the records refer to the client


async def test_values_without_a_subscription_are_read_again(dac: Dac) -> None:
    signal = await connected(voltage(poll=0.001))
    async for value in observe_value(signal):
        if value == 3.0:
            break
        dac.values[mpf.Float64] += 0.5


@pytest.mark.parametrize("options", [{"subscribe": mpf.OutOfBand()}, {}])
async def test_observers_learn_that_the_server_has_ended(options: dict[str, Any]) -> None:
    server = Dac()
    severities: asyncio.Queue[int] = asyncio.Queue()
    with server.start():
        signal = await connected(voltage(poll=0.001, **options))
        signal.subscribe_reading(
            lambda reading: severities.put_nowait(reading["voltage"]["alarm_severity"])
        )
        assert await severities.get() == 0
    while await severities.get() != -1:
        pass
    with Dac().start():  # the signal connects again
        while await severities.get() != 0:
            pass
    signal.clear_sub(signal._cache._listeners.copy().pop())


async def test_observers_learn_that_a_later_reply_is_an_error(dac: Dac) -> None:
    @dac.on(mpf.OutOfBand)
    async def fail(request: mpf.OutOfBand) -> AsyncIterator[float]:
        yield mpf.Float64(1)
        raise mpf.StatusError("broken")

    severities: asyncio.Queue[int] = asyncio.Queue()
    signal = await connected(voltage(subscribe=mpf.OutOfBand(), poll=0.001))
    signal.subscribe_reading(
        lambda reading: severities.put_nowait(reading["voltage"]["alarm_severity"])
    )
    assert [await severities.get() for _ in range(4)] == [0, -1, 0, -1]
    signal.clear_sub(signal._cache._listeners.copy().pop())


async def test_a_write_has_all_fields_of_its_template(dac: Dac) -> None:
    found = []
    dac.on(mpf.Char8Array)(lambda request: found.append((request.text, request.eom)))
    template = mpf.Char8Array(cmd=0x82, eom=b"\r")
    signal = await connected(mpf_signal_w(str, "dac", template, name="text"))

    await signal.set("VOLT 1")

    assert found == [("VOLT 1", b"\r")]


def test_a_plan_of_bluesky_moves_and_reads(dac: Dac, engine: RunEngine) -> None:
    class Supply(StandardReadable):
        def __init__(self, name: str = "") -> None:
            with self.add_children_as_readables():
                self.voltage = voltage(timeout=PATIENCE)
            super().__init__(name)

    documents: list[tuple[str, dict[str, Any]]] = []
    engine.subscribe(lambda name, document: documents.append((name, document)))
    with init_devices(timeout=PATIENCE):
        supply = Supply()

    def plan() -> Iterator[Any]:
        yield from bps.abs_set(supply.voltage, 0.25, wait=True)
        yield from bp.scan([supply], supply.voltage, 1.0, 2.0, 3)

    engine(plan())
    events = [document["data"] for name, document in documents if name == "event"]
    assert [event["supply-voltage"] for event in events] == [1.0, 1.5, 2.0]
    assert dac.values[mpf.Float64] == 2.0
