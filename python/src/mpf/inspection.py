# SPDX-License-Identifier: MIT
"""What the program `mpf` reports, as Python objects. docs/tools.md describes the contents."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from types import TracebackType
from typing import Any, TypeVar

from mpf import program
from mpf.errors import Error

Self = TypeVar("Self")


def servers(backplane: str = "", *, location: int | None = None) -> list[dict[str, Any]]:
    """The servers on this host, as `mpf ls --json`.

    backplane: its name; by default MPF_BACKPLANE, or all.
    location: only servers at this location.
    """
    found = [one for each in _report("ls", backplane) for one in each["servers"]]
    return [one for one in found if location is None or one["location"] == location]


def stats(server: str, backplane: str = "", *, location: int | None = None) -> dict[str, Any]:
    """The counters and latencies of a server, as `mpf msr --json`.

    Raises LookupError if there is no server of this name.
    """
    found: list[dict[str, Any]] = [
        one for one in _report("msr", backplane, *_at(location)) if one["name"] == server
    ]
    if not found:
        raise LookupError(f"no server is named {server!r}")
    return found[0]


class Tap:
    """The messages between a server and its clients, as an iterator; tap() creates it."""

    def __init__(self, command: list[str]) -> None:
        self._process = program.start(command)

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self

    def __next__(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if line:
            message: dict[str, Any] = json.loads(line)
            return message
        if self._process.wait() != 0:
            raise Error(program.error_of(self._process))
        raise StopIteration

    def close(self) -> None:
        """Ends the iteration."""
        program.stop(self._process)


def tap(
    server: str,
    backplane: str = "",
    *,
    location: int | None = None,
    seconds: float = 0,
    count: int = 0,
) -> Tap:
    """Each message between a server and its clients from now on, as `mpf tap --json`, without
    taking part.

    seconds, count: where to end; 0: close() ends it.
    """
    options = ["--json", "--count", str(count), *_backplane(backplane), *_at(location)]
    return Tap(["tap", server, str(seconds), *options])


# ---- the program


def _report(name: str, backplane: str, *options: str) -> Any:
    command = program.command([name, "--json", *options, *_backplane(backplane)])
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Error(done.stderr.strip())
    return json.loads(done.stdout)


def _at(location: int | None) -> list[str]:
    return [] if location is None else ["--location", str(location)]


def _backplane(name: str) -> list[str]:
    return ["--backplane", name] if name else []
