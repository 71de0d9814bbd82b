# SPDX-License-Identifier: MIT
"""Subscription: the replies to one request of a Client, as an iterator."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Generic, TypeVar, cast

from mpf._mpf import Message, Request
from mpf.closing import Closing
from mpf.errors import Error, NotConnected, is_end_of_server

if TYPE_CHECKING:
    from mpf.client import Client

C = TypeVar("C")  # the class of the client
M = TypeVar("M", bound=Message)

_LOOK = 0.1  # [s] between looks whether a subscription that waits for its server was closed


class SubscriptionBase(Generic[C, M]):
    """What the subscriptions of both kinds of clients have in common."""

    def __init__(
        self,
        client: C,
        message: Message,
        reply: type[Message] | None,
        timeout: float,
        limit: int,
        renew: bool,
    ) -> None:
        self._client = client
        self._message = message
        self._reply = reply
        self._timeout = timeout
        self._limit = limit
        self._renew = renew
        self._request: Request | None = None
        self._missed = 0
        self._isClosed = False

    @property
    def missed(self) -> int:
        """The number of replies that were dropped because the program did not take others."""
        return self._missed + (self._request.missed if self._request else 0)

    def _begin(self, request: Request) -> None:
        self._request = request
        if self._isClosed:
            request.close()

    def _hasEnded(self, error: Error) -> bool:
        """Whether the wait that raised this error has only to end, or to begin again."""
        return self._isClosed or (self._renew and is_end_of_server(error))

    def _drop(self) -> None:
        request, self._request = self._request, None
        if request is not None:
            self._missed += request.missed
            request.close()


class Subscription(Closing, SubscriptionBase["Client", M]):
    """The replies to one request, as an iterator; Client.subscribe() creates it."""

    def __iter__(self) -> Iterator[M]:
        return self

    def __next__(self) -> M:
        while not self._isClosed:
            message = self._first() if self._request is None else self._further()
            if message is not None:
                return message
            if not self._renew:
                self.close()
        raise StopIteration

    def close(self) -> None:
        """Ends the iteration, and drops later replies. The server is not told. Any thread."""
        self._isClosed = True
        self._drop()

    def _first(self) -> M | None:
        request = self._send()
        if request is None:
            return None
        try:
            self._begin(request)
            return cast(M, request.wait())
        except BaseException as error:  # also Ctrl-C, which has cancelled the request
            self._drop()
            if isinstance(error, Error) and self._hasEnded(error):
                return None
            raise

    def _send(self) -> Request | None:
        """Waits for the connection; returns None after close()."""
        end = time.monotonic() + self._timeout
        while not self._isClosed:
            left = max(end - time.monotonic(), 0.0)
            try:
                return self._client._send(
                    self._message, left, reply=self._reply, further=self._limit, waits=False
                )
            except NotConnected:
                if left == 0.0:
                    raise
                self._client.wait_connected(min(left, _LOOK))
        return None

    def _further(self) -> M | None:
        request = self._request
        if request is None:  # another thread has closed the subscription
            return None
        message = request.next(self._timeout)
        if message is None and request.connected:
            raise TimeoutError(f"{self._client.server}: no reply within {self._timeout} s")
        if message is None:
            self._drop()
        return cast("M | None", message)
