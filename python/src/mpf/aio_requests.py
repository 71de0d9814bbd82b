# SPDX-License-Identifier: MIT
"""AsyncRequest, AsyncSubscription: requests of an AsyncClient that were sent."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, TypeVar, cast

from mpf._mpf import Message, Request
from mpf.closing import AsyncClosing
from mpf.errors import Error
from mpf.subscription import SubscriptionBase

if TYPE_CHECKING:
    from mpf.aio import AsyncClient

M = TypeVar("M", bound=Message)

CONNECTION = 0  # stands for the connection among the numbers of requests


class AsyncRequest:
    """A request that was sent: AsyncClient.send_many() returns it."""

    def __init__(self, client: AsyncClient, request: Request, limit: float) -> None:
        self._client = client
        self._request = request
        self._limit = limit

    async def wait(self, *, check: bool = True) -> Message:
        """As Request.wait(). Cancelling it closes the request."""
        try:
            return await self._client._end(self._request, self._limit, check)
        except asyncio.CancelledError:
            self.close()
            raise

    async def next(self, timeout: float) -> Message | None:
        """Waits [s] for a further reply. None after that time and when the connection has ended."""
        limit = self._client._until(timeout)
        while (message := self._request.take_next()) is None:
            if not self.connected or not await self._client._changed(self.id, limit):
                return None
        return message

    def result(self, *, check: bool = True) -> Message | None:
        """As wait(), without waiting: None while the request has not ended."""
        return self._request.result(check=check)

    def cancel(self) -> None:
        """Ends the request as Cancelled, unless it has ended. The server may act on it."""
        self._request.cancel()

    def close(self) -> None:
        """Cancels the request, drops further replies, and ends each wait for it."""
        self._request.close()
        self._client._wake(self.id)

    @property
    def id(self) -> int:
        """The number of the request in its client."""
        return self._request.id

    @property
    def missed(self) -> int:
        """The number of further replies that were dropped."""
        return self._request.missed

    @property
    def connected(self) -> bool:
        """False when the connection of the request has ended: no further reply will come."""
        return self._request.connected


class AsyncSubscription(AsyncClosing, SubscriptionBase["AsyncClient", M]):
    """The replies to one request; AsyncClient.subscribe() creates it.

    Cancelling a wait for a reply, for example with asyncio.wait_for(), loses no reply: the next
    wait continues.
    """

    _hasFirst = False  # the request has had its first reply

    def __aiter__(self) -> AsyncIterator[M]:
        return self

    async def __anext__(self) -> M:
        while not self._isClosed:
            message = await (self._further() if self._hasFirst else self._first())
            if message is not None:
                return message
            if not self._renew:
                self.close()
        raise StopAsyncIteration

    def close(self) -> None:
        """Ends the iteration, and drops later replies. The server is not told."""
        self._isClosed = True
        self._drop()
        self._client._wake(CONNECTION)  # it may wait for the connection

    async def _first(self) -> M | None:
        client = self._client
        limit = client._until(self._timeout)
        request = self._request  # not None after a wait that was cancelled
        if request is None:
            while not client.connected and await client._changed(CONNECTION, limit):
                if self._isClosed:
                    return None
            request = await client._start(
                self._message, limit, reply=self._reply, further=self._limit
            )
            self._begin(request)
        try:
            message = await client._end(request, limit, True)
        except Error as error:
            self._drop()
            if self._hasEnded(error):
                return None
            raise
        self._hasFirst = self._request is request
        return cast(M, message)

    async def _further(self) -> M | None:
        limit = self._client._until(self._timeout)
        while (request := self._request) is not None:
            message = request.take_next()
            if message is not None:
                return cast(M, message)
            if not request.connected:
                self._drop()
            elif not await self._client._changed(request.id, limit):
                raise TimeoutError(f"{self._client.server}: no reply within {self._timeout} s")
        return None

    def _drop(self) -> None:
        request = self._request
        self._hasFirst = False
        super()._drop()
        if request is not None:
            self._client._wake(request.id)
