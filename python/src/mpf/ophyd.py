# SPDX-License-Identifier: MIT
"""Signals of ophyd-async on servers of MPF, for Bluesky.

    class Dac(StandardReadable):
        def __init__(self, server: str, name: str = "") -> None:
            with self.add_children_as_readables():
                self.voltage = mpf_signal_rw(float, server, Float64(cmd=1), Float64(cmd=2))
            super().__init__(name)

A signal is described by the messages that read and write it. Its value is an Int32 for the data
types `int`, `bool` and enumerations (their index), a Float64 for `float`, a Char8Array for `str`,
and an Int32Array or Float64Array for arrays of those numbers. All signals of one server share a
connection. The package `ophyd-async` must be installed.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import time
from collections.abc import AsyncGenerator, Iterable
from typing import Any, Generic, cast
from weakref import WeakValueDictionary

import numpy as np
from bluesky.protocols import Reading
from event_model import DataKey
from ophyd_async.core import (
    DEFAULT_TIMEOUT,
    NO_ARG_VOID_SIGNATURE,
    Array1D,
    Callback,
    CommandBackend,
    NotConnectedError,
    SignalBackend,
    SignalDatatypeT,
    SignalMetadata,
    SignalR,
    SignalRW,
    SignalW,
    TriggerableCommand,
    get_enum_cls,
    make_datakey,
)

from mpf._mpf import Char8Array, Float64, Float64Array, Int32, Int32Array, Message
from mpf.aio import AsyncClient
from mpf.errors import Error, StatusError
from mpf.replies import fields_of

__all__ = [
    "MpfCommandBackend",
    "MpfSignalBackend",
    "mpf_disconnect",
    "mpf_signal_r",
    "mpf_signal_rw",
    "mpf_signal_w",
    "mpf_triggerable_command",
]

_log = logging.getLogger("mpf")

_STALE = -1  # the alarm severity of a value that may have changed since

_VALUES: dict[Any, type[Message]] = {
    bool: Int32,
    int: Int32,
    float: Float64,
    str: Char8Array,
    Array1D[np.int32]: Int32Array,
    Array1D[np.float64]: Float64Array,
}


class MpfSignalBackend(SignalBackend[SignalDatatypeT]):
    """One value of a server; the arguments are those of mpf_signal_rw()."""

    def __init__(
        self,
        datatype: type[SignalDatatypeT],
        server: str,
        read: Message | None,
        write: Message | None,
        *,
        location: int | None = None,
        timeout: float = DEFAULT_TIMEOUT,
        subscribe: Message | None = None,
        poll: float = 1.0,
        units: str | None = None,
        precision: int | None = None,
    ) -> None:
        super().__init__(datatype)
        self._converter = _Converter(datatype)
        self._server = _Server(server, location, timeout)
        self._read = read
        self._write = write
        self._subscribe = subscribe
        self._poll = poll
        self._metadata = _metadata(datatype, units, precision)
        self._setpoint: SignalDatatypeT | None = None
        self._last: Reading[SignalDatatypeT] | None = None
        self._callback: Callback[Reading[SignalDatatypeT]] | None = None
        self._task: asyncio.Task[None] | None = None

    def source(self, name: str, read: bool) -> str:
        message = self._read if read else self._write
        return self._server.source(message or self._read or self._write)

    async def connect(self, timeout: float) -> None:
        await self._server.connect(timeout)
        if self._read is None:
            return
        try:  # a value of another type is found now
            await asyncio.wait_for(self.get_value(), timeout)
        except (Error, TypeError, TimeoutError) as error:
            raise NotConnectedError(f"{self.source('', True)}: {error}") from error

    async def put(self, value: SignalDatatypeT | None) -> None:
        assert self._write is not None
        message = self._write if value is None else self._converter.message(self._write, value)
        await self._server.call(message)
        self._setpoint = value
        if self._callback is None:
            return
        reading = await self.get_reading()
        if self._callback is not None:  # still
            self._callback(reading)

    async def get_datakey(self, source: str) -> DataKey:
        assert self.datatype is not None
        return make_datakey(self.datatype, await self.get_value(), source, self._metadata)

    async def get_reading(self) -> Reading[SignalDatatypeT]:
        assert self._read is not None
        return self._reading(await self._server.call(self._read))

    async def get_value(self) -> SignalDatatypeT:
        return (await self.get_reading())["value"]

    async def get_setpoint(self) -> SignalDatatypeT:
        """The value that was written last; before, the value that is read."""
        return await self.get_value() if self._setpoint is None else self._setpoint

    def set_callback(self, callback: Callback[Reading[SignalDatatypeT]] | None) -> None:
        if callback and self._callback:
            raise RuntimeError("a signal has one callback, which is already set")
        self._callback = callback
        if self._task:
            self._task.cancel()
            self._task = None
        if callback:
            self._task = asyncio.get_running_loop().create_task(self._watch(callback))

    async def _watch(self, callback: Callback[Reading[SignalDatatypeT]]) -> None:
        """Logs what the callback raises, because nobody awaits this task, and continues."""
        async for reading in self._readings():
            try:
                callback(reading)
            except Exception:
                _log.exception("%s: the callback for readings failed", self.source("", True))

    async def _readings(self) -> AsyncGenerator[Reading[SignalDatatypeT], None]:
        while True:
            with contextlib.suppress(Error, TypeError):
                async with contextlib.aclosing(self._replies()) as replies:
                    async for reply in replies:
                        yield self._reading(reply)
            if self._last is not None:
                yield {**self._last, "alarm_severity": _STALE}
            await asyncio.sleep(self._poll)

    async def _replies(self) -> AsyncGenerator[Message, None]:
        """Replies with the value, until the server disconnects."""
        client = self._server.client()
        if self._subscribe is None:
            assert self._read is not None
            while await client.wait_connected(self._poll):
                yield await client.call(self._read, DEFAULT_TIMEOUT, reply=Message)
                await asyncio.sleep(self._poll)
            return
        async with client.subscribe(self._subscribe, reply=Message, renew=False) as replies:
            async for reply in replies:
                if getattr(reply, "status", 0) != 0:
                    raise StatusError(client.server, reply)
                yield reply

    def _reading(self, reply: Message) -> Reading[SignalDatatypeT]:
        taken = reply.time_stamp_ns / 1e9 if reply.time_stamp_ns else time.time()
        value = self._converter.value(reply)
        self._last = {"value": value, "timestamp": taken, "alarm_severity": 0}
        return self._last


class MpfCommandBackend(CommandBackend[[], None]):
    """A request that makes a server do something."""

    def __init__(
        self,
        server: str,
        message: Message,
        *,
        location: int | None = None,
        timeout: float = DEFAULT_TIMEOUT,
    ) -> None:
        super().__init__(NO_ARG_VOID_SIGNATURE)
        self._server = _Server(server, location, timeout)
        self._message = message

    def source(self, name: str) -> str:
        return self._server.source(self._message)

    async def connect(self, timeout: float) -> None:
        await self._server.connect(timeout)

    async def execute(self) -> None:
        await self._server.call(self._message)


def mpf_signal_r(
    datatype: type[SignalDatatypeT],
    server: str,
    read: Message,
    *,
    name: str = "",
    timeout: float = DEFAULT_TIMEOUT,
    **options: Any,
) -> SignalR[SignalDatatypeT]:
    """A value that can be read. The arguments are those of mpf_signal_rw()."""
    backend = MpfSignalBackend(datatype, server, read, None, timeout=timeout, **options)
    return SignalR(backend, name=name, timeout=timeout)


def mpf_signal_rw(
    datatype: type[SignalDatatypeT],
    server: str,
    read: Message,
    write: Message,
    *,
    name: str = "",
    timeout: float = DEFAULT_TIMEOUT,
    **options: Any,
) -> SignalRW[SignalDatatypeT]:
    """A value that can be read and written.

    read: the request whose reply has the value.
    write: the request that writes, with another value each time. Its reply is awaited; a status
        other than 0 raises StatusError. A write of None sends it as it is.
    timeout: [s] of an access; then TimeoutError. If the server is absent for half of this time,
        the access raises NotConnectedError.

    The options of all signals:

    location: of the server; by default MPF_LOCATION, or 0.
    subscribe: the request whose replies each have the value. Without it, an observed signal is read
        every `poll` seconds. When the server cannot be reached, or refuses, observers get the last
        reading with the alarm severity -1.
    units, precision: metadata of numbers.
    """
    backend = MpfSignalBackend(datatype, server, read, write, timeout=timeout, **options)
    return SignalRW(backend, name=name, timeout=timeout)


def mpf_signal_w(
    datatype: type[SignalDatatypeT],
    server: str,
    write: Message,
    *,
    name: str = "",
    timeout: float = DEFAULT_TIMEOUT,
    **options: Any,
) -> SignalW[SignalDatatypeT]:
    """A value that can be written. The arguments are those of mpf_signal_rw()."""
    backend = MpfSignalBackend(datatype, server, None, write, timeout=timeout, **options)
    return SignalW(backend, name=name, timeout=timeout)


def mpf_triggerable_command(
    server: str,
    message: Message,
    *,
    location: int | None = None,
    name: str = "",
    timeout: float = DEFAULT_TIMEOUT,
) -> TriggerableCommand:
    """A command without arguments: `trigger()` sends the request and awaits its reply."""
    backend = MpfCommandBackend(server, message, location=location, timeout=timeout)
    return TriggerableCommand(backend, name=name, timeout=timeout)


# ---- servers

_Key = tuple[asyncio.AbstractEventLoop, str, "int | None"]
_clients: WeakValueDictionary[_Key, AsyncClient] = WeakValueDictionary()


class _Server:
    def __init__(self, name: str, location: int | None, timeout: float) -> None:
        self._key = (name, location)
        # ophyd ends an access without a reason when its whole time has passed.
        self._patience = timeout / 2
        self._client: AsyncClient | None = None  # it lives as long as one of its signals

    def client(self) -> AsyncClient:
        """Shared by all signals in the event loop."""
        key = (asyncio.get_running_loop(), *self._key)
        self._client = _clients.get(key) or AsyncClient(*self._key)
        _clients[key] = self._client
        return self._client

    async def connect(self, timeout: float) -> None:
        if not await self.client().wait_connected(timeout):
            raise NotConnectedError(f"the server {self._key[0]} is absent: `mpf ls` lists servers")

    async def call(self, message: Message) -> Message:
        """Waits for the reply until it is cancelled, for an absent server until then."""
        await self.connect(self._patience)
        reply: Message = await self.client().call(message, math.inf, reply=Message)
        return reply

    def source(self, message: Message | None) -> str:
        name, location = self._key
        return f"mpf://{name}{'' if location is None else f'@{location}'}/{message!r}"


def mpf_disconnect() -> None:
    """Closes all connections of signals; a signal that is used again opens a new one. Call it in
    the event loop of the signals. A loop that is closed ends its connections, too, as soon as its
    signals are no longer used."""
    for client in list(_clients.values()):
        client.close()
    _clients.clear()


# ---- values


class _Converter(Generic[SignalDatatypeT]):
    """Between values of a data type and messages."""

    def __init__(self, datatype: type[SignalDatatypeT]) -> None:
        self._datatype: Any = datatype
        self._choices = _choices(datatype)
        found = Int32 if self._choices else _VALUES.get(datatype)
        if found is None:
            known = ", ".join(getattr(one, "__name__", str(one)) for one in _VALUES)
            raise TypeError(f"no message has a value of type {datatype}; use one of {known}")
        self._type = found

    def value(self, reply: Message) -> Any:
        if not isinstance(reply, self._type):
            expected = self._type.__name__
            raise TypeError(f"the reply is {reply!r}; a {self._datatype} is in an {expected}")
        if isinstance(reply, Char8Array):
            return reply.text
        value = cast(Any, reply).value
        if self._type in (Int32Array, Float64Array):
            return value.copy()  # readings are kept, and the memory of the reply is needed again
        return self._choice(value) if self._choices else self._datatype(value)

    def message(self, template: Message, value: Any) -> Message:
        """A message as `template`, with another value."""
        number = self._choices.index(value) if self._choices else value
        kind: Any = type(template)
        return kind(number, **fields_of(template))  # type: ignore[no-any-return]

    def _choice(self, index: int) -> Any:
        if 0 <= index < len(self._choices):
            return self._choices[index]
        raise TypeError(f"{self._datatype.__name__} has no choice {index}")


def _metadata(datatype: Any, units: str | None, precision: int | None) -> SignalMetadata:
    metadata: SignalMetadata = {}
    if units is not None:
        metadata["units"] = units
    if precision is not None:
        metadata["precision"] = precision
    if choices := _choices(datatype):
        metadata["choices"] = [choice.value for choice in choices]
    return metadata


def _choices(datatype: Any) -> list[Any]:
    """The members of an enumeration; of other types none."""
    return list(cast("Iterable[Any]", get_enum_cls(datatype) or ()))
