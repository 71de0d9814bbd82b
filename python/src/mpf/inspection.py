# SPDX-License-Identifier: MIT
"""What the program `mpf` reports, as Python objects. docs/tools.md describes the contents."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from collections.abc import Iterator
from types import TracebackType
from typing import IO, Any, TypeVar

from mpf import program
from mpf.errors import Error

_PATIENCE = 10.0  # [s] for a recording to begin

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


class Running:
    """A subcommand of `mpf` that runs until close(), or until the end of a `with` block."""

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
        if error is None:
            self.close()
        else:
            program.stop(self._process)

    def close(self) -> None:
        """Ends it. Raises Error if it has failed."""
        program.stop(self._process)
        if self._process.returncode not in (0, -signal.SIGTERM):
            raise Error(program.error_of(self._process))

    def _await(self, stream: IO[str] | None, pattern: str, patience: float) -> None:
        """Waits for the first line of its stdout or stderr, which matches unless it fails."""
        assert stream is not None
        line = program.first_line(self._process, stream, patience)
        if not re.match(pattern, line):
            raise Error((line + program.error_of(self._process)).strip())


class Tap(Running):
    """The messages between a server and its clients, as an iterator; tap() creates it."""

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self

    def __next__(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        if self._process.stdout.closed:  # close() was called
            raise StopIteration
        line = self._process.stdout.readline()
        if line:
            message: dict[str, Any] = json.loads(line)
            return message
        if self._process.wait() != 0:
            raise Error(program.error_of(self._process))
        raise StopIteration


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
    return Tap(["tap", *options, "--", server, str(seconds)])


class Recording(Running):
    """Writes messages to a file; record() creates it."""

    #: After close(): the number of messages that came too fast to be written.
    missed: int

    def close(self) -> None:
        """Ends the recording, and sets `missed`. Raises Error if the file could not be written, or
        if messages could not be read."""
        super().close()
        found = re.search(r"(\d+) missed", program.error_of(self._process))
        assert found is not None
        self.missed = int(found[1])


def record(
    server: str, file: str | os.PathLike[str], backplane: str = "", *, location: int | None = None
) -> Recording:
    """Writes each message between a server and its clients from now on to a file, until close():

        with mpf.record("dac", "calls.mpf"):
            ...

    The same as `mpf tap --write`. Raises Error if the file cannot be written, or if the recording
    has not begun within 10 s.
    """
    options = [f"--write={os.fspath(file)}", *_backplane(backplane), *_at(location)]
    recording = Recording(["tap", *options, "--", server, "0"])
    pattern = r"mpf tap: .*( now|; waiting for it)$"
    recording._await(recording._process.stderr, pattern, _PATIENCE)
    return recording


class Ghost(Running):
    """A server that replies as in a recording; replay() creates it."""

    #: After close(): numbers of `requests`, `similar` ones, `unknown` (refused) ones, `silent` (not
    #: answered) ones, and of `replies`.
    counts: dict[str, int]

    def close(self) -> None:
        """Ends the server, and sets `counts`. Raises Error if it has failed."""
        super().close()
        self.counts = json.loads(self._process.communicate()[0])


def replay(
    file: str | os.PathLike[str],
    server: str = "",
    backplane: str = "",
    *,
    location: int | None = None,
    speed: float = 1.0,
    timeout: float = 60.0,
) -> Ghost:
    """Starts a server that replies to its clients as in a recording, with the same delays:

        with mpf.replay("calls.mpf"), mpf.Client("dac") as dac:
            ...

    docs/tools.md describes which reply belongs to which request, at `mpf replay`.

    server: its name; by default that of the recording.
    speed: 2 halves the delays, 0 leaves them out.
    timeout: [s] to read the recording in.

    Raises Error if the recording is damaged, if it takes longer to read, or if another process
    serves this name.
    """
    options = [f"--server={server}"] if server else []
    options += ["--speed", str(speed), "--json", *_backplane(backplane), *_at(location)]
    ghost = Ghost(["replay", "--as-server", *options, "--", os.fspath(file)])
    ghost._await(ghost._process.stdout, r"\{", timeout)
    return ghost


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
    return [f"--backplane={name}"] if name else []
