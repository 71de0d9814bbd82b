# SPDX-License-Identifier: MIT
"""The end of servers: by SIGTERM, and with the program."""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING
from weakref import WeakSet

if TYPE_CHECKING:
    from mpf.server import Server

#: How long the end of the program waits for all handlers in progress [s].
_PATIENCE = 1.0

_servers: WeakSet[Server] = WeakSet()


def close_at_exit(server: Server) -> None:
    """Without it, a server that runs in a thread would end as if it had died."""
    _servers.add(server)


@atexit.register
def _close_all() -> None:
    servers = list(_servers)
    end = time.monotonic() + _PATIENCE
    for server in servers:
        server._interrupt()
    for server in servers:
        thread = server._thread or server._runner
        if thread is not None and thread is not threading.current_thread():
            thread.join(max(end - time.monotonic(), 0.0))
        server._close()


# Servers belong to the process that made them.
os.register_at_fork(after_in_child=_servers.clear)


@contextlib.contextmanager
def at_sigterm(act: Callable[[], None]) -> Generator[None]:
    """Calls `act` at the first SIGTERM; a second one ends the process. Only in the main thread, and
    if the program does not handle SIGTERM itself."""
    isMain = threading.current_thread() is threading.main_thread()
    if not isMain or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return

    def handle(number: int, frame: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        act()

    signal.signal(signal.SIGTERM, handle)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGTERM) is handle:  # the program may have set its own since
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
