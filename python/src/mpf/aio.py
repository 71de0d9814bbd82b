# SPDX-License-Identifier: MIT
"""AsyncClient: the client for asyncio. A task that is cancelled cancels its request.

A client belongs to the event loop in which it is first used. The loop watches one file descriptor;
no thread is started.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar, overload

from mpf import _mpf
from mpf._mpf import (
    Char8Array,
    Float64,
    Float64Array,
    Int32,
    Int32Array,
    Message,
    Request,
    SerialConfig,
)
from mpf.aio_requests import CONNECTION, AsyncRequest, AsyncSubscription
from mpf.client import LIMIT
from mpf.closing import AsyncClosing
from mpf.errors import NotConnected, QueueFull
from mpf.seconds import checked_seconds

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

M = TypeVar("M", bound=Message)
R = TypeVar("R", bound=Message)
S = TypeVar("S")



class AsyncClient(AsyncClosing, _mpf.BaseClient):
    """As Client, for asyncio: `await client.call(...)`, `async for ... in client.subscribe()`. The
    arguments are those of Client."""

    def __init__(
        self,
        server: str,
        location: int | None = None,
        *,
        backplane: str = "",
        timeout: float = 5.0,
        wait: str = "adaptive",
    ) -> None:
        super().__init__(server, location, backplane=backplane, timeout=timeout, wait=wait)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._descriptor = -1
        self._timer: asyncio.TimerHandle | None = None
        self._waiting: dict[int, list[asyncio.Future[None]]] = {}

    def close(self) -> None:
        """Disconnects. Calls in progress raise Cancelled."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.remove_reader(self._descriptor)
            if self._timer is not None:
                self._timer.cancel()
        self._loop = None
        self._close()
        for number in list(self._waiting):
            self._wake(number)

    async def wait_connected(self, timeout: float | None = None) -> bool:
        """Waits [s] for the connection; returns False after that time."""
        self._attach()
        limit = self._until(timeout)
        while not self.connected:
            if not await self._changed(CONNECTION, limit):
                return False
        return True

    @overload
    async def call(
        self,
        message: SerialConfig,
        timeout: float | None = None,
        *,
        retry: bool = False,
    ) -> Int32: ...
    @overload
    async def call(
        self,
        message: M,
        timeout: float | None = None,
        *,
        retry: bool = False,
    ) -> M: ...
    @overload
    async def call(
        self,
        message: Message,
        timeout: float | None = None,
        *,
        reply: type[R],
        retry: bool = False,
    ) -> R: ...
    @overload
    async def call(
        self,
        message: Message,
        timeout: float | None = None,
        *,
        reply: type[Message] | None = None,
        retry: bool = False,
        check: bool,
    ) -> Any: ...
    async def call(
        self,
        message: Message,
        timeout: float | None = None,
        *,
        reply: type[Message] | None = None,
        retry: bool = False,
        check: bool = True,
    ) -> Any:
        """Sends a request and waits for its reply. Cancelling the task cancels the request; the
        server may act on it all the same.

        message: the request. It can be sent again; a loaned array is empty then.
        timeout: [s] for the connection, the request and the reply together; None: that of the
            client.
        reply: the class of the reply, mpf.Message for any; by default that of the request, and
            Int32 for a SerialConfig.
        retry: if the server ends before it has taken the request, send it to the next server of
            this name. No request is executed twice by it.
        check: raise StatusError if the status of the reply is not 0, and UnexpectedReply if it is
            of another class. False: return any reply.

        Raises the exceptions of Client.call().
        """
        limit = self._until(timeout)
        request = await self._start(message, limit, reply=reply, retry=retry)
        try:
            return await self._end(request, limit, check)
        finally:
            request.close()  # cancels the request if it has not ended

    async def send_many(
        self,
        messages: Iterable[Message],
        timeout: float | None = None,
        *,
        reply: type[Message] | None = None,
        further: int = 0,
    ) -> list[AsyncRequest]:
        """As Client.send_many(): returns the requests that were sent, without waiting for their
        replies.
        """
        limit = self._until(timeout)
        many = list(messages)
        sent = await self._sent(self._send_many, many, limit, reply=reply, further=further)
        return [AsyncRequest(self, request, limit) for request in sent]

    @overload
    def subscribe(
        self, message: M, *, timeout: float = math.inf, limit: int = LIMIT, renew: bool = True
    ) -> AsyncSubscription[M]: ...
    @overload
    def subscribe(
        self,
        message: Message,
        *,
        reply: type[R],
        timeout: float = math.inf,
        limit: int = LIMIT,
        renew: bool = True,
    ) -> AsyncSubscription[R]: ...
    def subscribe(
        self,
        message: Message,
        *,
        reply: type[Message] | None = None,
        timeout: float = math.inf,
        limit: int = LIMIT,
        renew: bool = True,
    ) -> AsyncSubscription[Any]:
        """As Client.subscribe(): `async for reply in client.subscribe(message)`."""
        return AsyncSubscription(self, message, reply, timeout, limit, renew)

    # ---- calls by type

    async def int32(
        self,
        value: int = 0,
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Int32:
        """As Client.int32()."""
        return await self.call(Int32(value, cmd=cmd, address=address, extra=extra), timeout)

    async def float64(
        self,
        value: float = 0.0,
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Float64:
        """As Client.float64()."""
        return await self.call(Float64(value, cmd=cmd, address=address, extra=extra), timeout)

    async def int32_array(
        self,
        value: ArrayLike = (),
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Int32Array:
        """As Client.int32_array()."""
        return await self.call(Int32Array(value, cmd=cmd, address=address, extra=extra), timeout)

    async def float64_array(
        self,
        value: ArrayLike = (),
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Float64Array:
        """As Client.float64_array()."""
        return await self.call(Float64Array(value, cmd=cmd, address=address, extra=extra), timeout)

    async def char8_array(
        self,
        value: str | bytes = b"",
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Char8Array:
        """As Client.char8_array()."""
        return await self.call(Char8Array(value, cmd=cmd, address=address, extra=extra), timeout)

    # ---- the event loop

    def _attach(self) -> asyncio.AbstractEventLoop:
        loop = asyncio.get_running_loop()
        if self._loop is None:
            self._loop = loop
            self._descriptor = self._fileno()
            loop.add_reader(self._descriptor, self._drain)
            self._drain()
        elif self._loop is not loop:
            raise RuntimeError("the client belongs to another event loop: create one for each")
        return loop

    def _drain(self) -> None:
        for number in self._run_pending():
            self._wake(number)
        self._set_timer()

    def _wake(self, number: int) -> None:
        waiting = self._waiting
        if number == CONNECTION:  # each request may have lost its connection
            futures = [future for group in waiting.values() for future in group]
            waiting.clear()
        else:
            futures = waiting.pop(number, [])
        for future in futures:
            if not future.done():
                future.set_result(None)

    def _set_timer(self) -> None:
        left = self._next_deadline()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if left is not None and self._loop is not None:
            self._timer = self._loop.call_later(left, self._drain)

    def _until(self, timeout: float | None) -> float:
        seconds = checked_seconds(self.timeout if timeout is None else timeout)
        return self._attach().time() + seconds

    async def _changed(self, number: int, limit: float) -> bool:
        """Waits for an event of request `number`; returns False after `limit`."""
        loop = self._attach()
        left = limit - loop.time()
        if left <= 0:
            return False
        future: asyncio.Future[None] = loop.create_future()
        self._waiting.setdefault(number, []).append(future)
        timer = None
        if left < math.inf:
            timer = loop.call_later(left, _finish, future)
        try:
            await future
        finally:
            if timer is not None:
                timer.cancel()
            group = self._waiting.get(number, [])
            if future in group:
                group.remove(future)
                if not group:
                    del self._waiting[number]
        return True

    # ---- requests

    async def _start(self, message: Message, limit: float, **options: Any) -> Request:
        return await self._sent(self._send, message, limit, **options)

    async def _sent(self, send: Callable[..., S], what: Any, limit: float, **options: Any) -> S:
        """Calls `send` with these arguments as soon as the client is connected."""
        loop = self._attach()
        has_drained = False
        while True:
            left = limit - loop.time()
            try:
                sent = send(what, max(left, 0.0), waits=False, **options)
            except NotConnected:
                if left <= 0 or not await self.wait_connected(left):
                    raise
            except QueueFull:  # perhaps of replies that the loop has not seen yet
                if has_drained:
                    raise
                has_drained = True
                self._drain()
            else:
                self._set_timer()
                return sent

    async def _end(self, request: Request, limit: float, check: bool) -> Message:
        while (reply := request.result(check=check)) is None:
            if not await self._changed(request.id, limit):
                try:
                    return request.wait(check=check)  # raises: its time has passed
                finally:
                    self._drain()  # wait() has taken what arrived for others, too
        return reply


def _finish(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)
