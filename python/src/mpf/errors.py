# SPDX-License-Identifier: MIT
"""The exceptions of mpf.

    Error ─┬─ NotSent ─┬─ NotConnected   also a ConnectionError
           │           ├─ QueueFull
           │           └─ TooLarge
           ├─ NoReply ─┬─ Refused
           │           ├─ NeverTaken     nothing was done
           │           ├─ Expired        nothing was done; also a TimeoutError
           │           ├─ OutcomeUnknown ── TimedOut   also a TimeoutError
           │           └─ Cancelled
           ├─ StatusError                the server replied with an error
           │     └─ InstrumentError ── InstrumentTimeout   also a TimeoutError
           ├─ UnexpectedReply            the reply is of another class
           └─ NameInUse                  another process serves this name
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from mpf._mpf import Char8Array, Message


class Error(Exception):
    """Any failure that this package reports. It can be pickled; the copy has no reply."""

    def __reduce__(self) -> tuple[Any, ...]:
        attributes = dict(self.__dict__)
        if "reply" in attributes:
            attributes["reply"] = None
        return _copy, (type(self), self.args, attributes)


class NotSent(Error):
    """The request was not sent: nothing was done."""


class NotConnected(NotSent, ConnectionError):
    """The server is absent, or the connection to it was not made in time."""


class QueueFull(NotSent):
    """The server has not taken earlier requests, or too many of them have no reply."""


class TooLarge(NotSent):
    """The message is larger than the server accepts."""


class NoReply(Error):
    """The request was sent and ended without a reply. Each kind says what happened to it."""

    #: The name of the fate, as in the tools and in C++.
    fate: ClassVar[str] = ""


class Refused(NoReply):
    """The server did not accept the request, or ended it without a reply."""

    fate = "refused"


class NeverTaken(NoReply):
    """The connection ended before the server took the request: nothing was done."""

    fate = "neverTaken"


class OutcomeUnknown(NoReply):
    """The server took the request, or may have taken it, and no reply followed."""

    fate = "outcomeUnknown"


class TimedOut(OutcomeUnknown, TimeoutError):
    """The server took the request and did not reply in time. It may still act on it."""


class Expired(NoReply, TimeoutError):
    """The server did not take the request in time: nothing was done."""

    fate = "expired"


class Cancelled(NoReply):
    """The program cancelled the request. The server may have acted on it."""

    fate = "cancelled"


class UnexpectedReply(Error):
    """The reply is of another class than the call expects."""

    def __init__(self, server: str, reply: Message) -> None:
        #: The reply; None after pickling.
        self.reply: Message | None = reply
        super().__init__(
            f"{server}: the reply is a {type(reply).__name__}; "
            f"pass reply=mpf.{type(reply).__name__} if you expect it"
        )


class NameInUse(Error):
    """Another process serves this name at this location."""


class StatusError(Error):
    """The server replied with a status other than 0.

    In a handler of a :class:`mpf.Server`, ``raise StatusError("no such channel", status=-3)`` sends
    this status and this text.
    """

    def __init__(self, text: str, reply: Message | None = None, *, status: int = -1) -> None:
        #: The reply; None if a handler raised the exception, and after pickling.
        self.reply = reply
        #: The status of the reply.
        self.status: int = status if reply is None else getattr(reply, "status")
        #: The words of the server, without its name; empty if it sent none.
        self.text = text if reply is None else _text_of(reply)
        if reply is None:
            super().__init__(text)
        else:
            reason = f": {self.text}" if self.text else ""
            super().__init__(f"{text}: status {self.status}{reason}")


class InstrumentError(StatusError):
    """An operation of Serial or Gpib failed. `status` is that of the server."""

    def __init__(self, text: str, reply: Char8Array) -> None:
        super().__init__(text, reply)
        #: The bytes that the instrument had sent; of a failed request the reason in words.
        self.answer = reply.value


class InstrumentTimeout(InstrumentError, TimeoutError):
    """The instrument did not answer completely, or did not accept all bytes, in time."""


def is_end_of_server(error: Error) -> bool:
    """Whether the connection has ended: the request may be sent again to the next server."""
    return isinstance(error, (NeverTaken, OutcomeUnknown)) and not isinstance(error, TimeoutError)


def _copy(kind: type[Error], arguments: tuple[Any, ...], attributes: dict[str, Any]) -> Error:
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(attributes)
    return error


def _text_of(reply: Message) -> str:
    from mpf._mpf import Char8Array

    return reply.text if isinstance(reply, Char8Array) else ""
