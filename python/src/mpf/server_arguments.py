# SPDX-License-Identifier: MIT
"""Arguments of a Server that need a check or an explanation."""

from __future__ import annotations

import contextlib
import grp
import os
from collections.abc import Generator

from mpf._mpf import Message
from mpf.errors import NameInUse


def check_class(kind: object) -> None:
    if not (isinstance(kind, type) and issubclass(kind, Message)):
        raise TypeError(f"on: {kind!r} is not a class of messages, for example mpf.Int32")


def checked_mode(mode: int) -> int:
    """Returns the mode, which may only let others read and write, not this user less."""
    if mode & ~0o666 or mode & 0o600 != 0o600:
        raise ValueError(f"mode: {mode:#o} is not from 0o600 to 0o666, for example 0o660")
    return mode


def number_of_group(name: str) -> int:
    try:
        return grp.getgrnam(name).gr_gid
    except KeyError:
        raise ValueError(f"group: the group {name!r} does not exist") from None


@contextlib.contextmanager
def own_name_explained(name: str) -> Generator[None]:
    """Says if it is this process that serves the name, as when a notebook runs a cell again."""
    try:
        yield
    except NameInUse as error:
        if f", pid {os.getpid()} (" not in str(error):
            raise
        raise NameInUse(
            f"{name}: this process has a server of this name; its close() frees the name"
        ) from None
