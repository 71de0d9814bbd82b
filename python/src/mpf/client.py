# SPDX-License-Identifier: MIT
"""Client: calls of a server that wait for the reply.

Any number of threads may use one client at the same time. A call that waits releases the GIL, and
Ctrl-C ends it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
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
from mpf.closing import Closing
from mpf.subscription import Subscription

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

M = TypeVar("M", bound=Message)
R = TypeVar("R", bound=Message)

#: Further replies that wait for a program, for each subscription.
LIMIT = 1000


class Client(Closing, _mpf.BaseClient):
    """A client of the server `server` at `location`.

    location: of the server; by default MPF_LOCATION, or 0.
    backplane: the name of the backplane; by default MPF_BACKPLANE, or "default".
    timeout: [s] the time limit of calls without their own.
    wait: "adaptive" polls for a short time and then sleeps; "spin" only polls, which gives the
        shortest latency and keeps a processor busy; "block" sleeps at once.

    The constructor does not wait for the server, which may start later, and restart.

    Raises OSError if there is no memory in /dev/shm or no file descriptor, ValueError if an
    argument is invalid.
    """

    def close(self) -> None:
        """Disconnects. Requests without a reply end as Cancelled."""
        self._close()

    def wait_connected(self, timeout: float | None = None) -> bool:
        """Waits [s] for the connection; returns False after that time."""
        return self._wait_connected(timeout)

    if TYPE_CHECKING:

        @overload
        def call(
            self,
            message: SerialConfig,
            timeout: float | None = None,
            *,
            retry: bool = False,
        ) -> Int32: ...
        @overload
        def call(
            self,
            message: M,
            timeout: float | None = None,
            *,
            retry: bool = False,
        ) -> M: ...
        @overload
        def call(
            self,
            message: Message,
            timeout: float | None = None,
            *,
            reply: type[R],
            retry: bool = False,
        ) -> R: ...
        @overload
        def call(
            self,
            message: Message,
            timeout: float | None = None,
            *,
            reply: type[Message] | None = None,
            retry: bool = False,
            check: bool,
        ) -> Any: ...
        def call(self, message: Message, timeout: float | None = None, **options: Any) -> Any: ...

    else:
        call = _mpf.BaseClient.call  # a function of Python around it would cost 0.2 us

    def send(
        self,
        message: Message,
        timeout: float | None = None,
        *,
        reply: type[Message] | None = None,
        retry: bool = False,
        further: int = 0,
    ) -> Request:
        """Sends a request, and returns it without waiting for its reply. A Request that the program
        drops is cancelled.

        further: the number of further replies to the request that may wait for the program.

        The other arguments and the exceptions are those of call().
        """
        return self._send(message, timeout, reply=reply, retry=retry, further=further)

    def send_many(
        self,
        messages: Iterable[Message],
        timeout: float | None = None,
        *,
        reply: type[Message] | None = None,
        further: int = 0,
    ) -> list[Request]:
        """Sends requests in order, until one cannot be sent, and returns those that were sent. A
        sleeping server is woken at most once.

        The list is shorter than `messages` if for example the queue of the server is full: wait for
        the oldest request, then send the rest again. If not even the first request was sent, this
        raises the reason, as send() does. Messages that were not sent, including loaned arrays, are
        unchanged.

        The arguments are those of send(), for each request. No request is resent automatically.
        """
        return self._send_many(list(messages), timeout, reply=reply, further=further)

    @overload
    def subscribe(
        self, message: M, *, timeout: float = math.inf, limit: int = LIMIT, renew: bool = True
    ) -> Subscription[M]: ...
    @overload
    def subscribe(
        self,
        message: Message,
        *,
        reply: type[R],
        timeout: float = math.inf,
        limit: int = LIMIT,
        renew: bool = True,
    ) -> Subscription[R]: ...
    def subscribe(
        self,
        message: Message,
        *,
        reply: type[Message] | None = None,
        timeout: float = math.inf,
        limit: int = LIMIT,
        renew: bool = True,
    ) -> Subscription[Any]:
        """Sends a request to which the server replies any number of times, and iterates over all
        replies.

        reply: the class of the first reply, by default that of the request.
        timeout: [s] the longest wait for the next reply; then TimeoutError.
        limit: replies that may wait for the program; then the oldest is dropped and counted.
        renew: when the server ends, subscribe again as soon as there is one. Otherwise the
            iteration ends.
        """
        return Subscription(self, message, reply, timeout, limit, renew)

    # ---- calls by type

    def int32(
        self,
        value: int = 0,
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Int32:
        """Calls with an Int32 of these fields; `timeout` is that of call()."""
        return self.call(Int32(value, cmd=cmd, address=address, extra=extra), timeout)

    def float64(
        self,
        value: float = 0.0,
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Float64:
        """Calls with a Float64 of these fields; `timeout` is that of call()."""
        return self.call(Float64(value, cmd=cmd, address=address, extra=extra), timeout)

    def int32_array(
        self,
        value: ArrayLike = (),
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Int32Array:
        """Calls with an Int32Array of these fields; `timeout` is that of call()."""
        return self.call(Int32Array(value, cmd=cmd, address=address, extra=extra), timeout)

    def float64_array(
        self,
        value: ArrayLike = (),
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Float64Array:
        """Calls with a Float64Array of these fields; `timeout` is that of call()."""
        return self.call(Float64Array(value, cmd=cmd, address=address, extra=extra), timeout)

    def char8_array(
        self,
        value: str | bytes = b"",
        *,
        cmd: int = 0,
        address: int = 0,
        extra: int = 0,
        timeout: float | None = None,
    ) -> Char8Array:
        """Calls with a Char8Array of these fields; `timeout` is that of call()."""
        return self.call(Char8Array(value, cmd=cmd, address=address, extra=extra), timeout)
