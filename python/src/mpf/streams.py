# SPDX-License-Identifier: MIT
"""Streams: the async generators of a server that reply to requests."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Generator

_LOOK = 0.5  # [s] between looks whether the client of a generator has gone


class Streams:
    """Cancels the tasks of generators whose clients have gone: they may wait for something else."""

    def __init__(self) -> None:
        self._has_client: dict[asyncio.Task[object], Callable[[], bool]] = {}
        self._look: asyncio.TimerHandle | None = None

    def tasks(self) -> set[asyncio.Task[object]]:
        return set(self._has_client)

    @contextlib.contextmanager
    def running(self, has_client: Callable[[], bool]) -> Generator[None]:
        """The current task runs a generator."""
        task = asyncio.current_task()
        assert task is not None
        self._has_client[task] = has_client
        self.look_soon()
        try:
            yield
        finally:
            del self._has_client[task]

    def look_soon(self) -> None:
        if self._has_client and self._look is None:
            self._look = asyncio.get_running_loop().call_later(_LOOK, self._look_at_clients)

    def stop_looking(self) -> None:
        if self._look is not None:
            self._look.cancel()
            self._look = None

    def _look_at_clients(self) -> None:
        self._look = None
        for task, has_client in self._has_client.items():
            if not has_client():
                task.cancel()
