# SPDX-License-Identifier: MIT
"""What becomes of the value and of the exception of a handler."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from types import AsyncGeneratorType
from typing import Any, cast

from mpf._mpf import Char8Array, Message
from mpf.errors import StatusError

_COPIED = ("timeout", "cmd", "address", "extra", "number_retrys", "eom")


class NoMoreReplies(Exception):
    """The client has gone, or the server ends."""


class NotHandled(StatusError):
    """The server has no handler for requests of this class."""


def needs_loop(result: object) -> bool:
    """Whether what a handler has returned runs in an event loop."""
    return inspect.isawaitable(result) or isinstance(result, AsyncGeneratorType)


def with_value(request: Message, value: object) -> Message:
    """The request with this value."""
    kind = cast(Callable[..., Message], type(request))
    try:
        return kind(value, **fields_of(request))
    except TypeError as error:
        raise TypeError(
            f"{type(value)} is not the value of a reply to {kind.__name__} requests: "
            "reply with a message"
        ) from error


def of_error(request: Message, error: BaseException) -> Char8Array:
    """The reply to a request whose handler has raised this exception."""
    status = _status_of(error) if isinstance(error, StatusError) else -1
    fields: dict[str, Any] = {**fields_of(request), "status": status}
    return Char8Array(text_of(error).encode("utf-8", "backslashreplace"), **fields)


def fields_of(message: Message) -> dict[str, Any]:
    """The fields that a message has in common with another one of its kind: all but the value, the
    status and the time stamp."""
    return {name: getattr(message, name) for name in _COPIED if hasattr(message, name)}


def _status_of(error: StatusError) -> int:
    status: Any = error.status
    isStatus = isinstance(status, int) and status != 0 and -(2**31) <= status < 2**31
    return error.status if isStatus else -1


def text_of(error: BaseException) -> str:
    """What the client is told."""
    kind = type(error).__name__
    try:  # what a program raises need not have a text
        return str(error.text) if isinstance(error, StatusError) else f"{kind}: {error}"
    except Exception:
        return kind
