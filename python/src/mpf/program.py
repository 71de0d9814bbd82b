# SPDX-License-Identifier: MIT
"""Finds, starts and stops the program `mpf`, which is part of the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from mpf.errors import Error

_PATIENCE = 10.0  # [s] for a program to end by itself


def find() -> str:
    """The program `mpf` of this package, or else of PATH.

    Raises FileNotFoundError if neither exists.
    """
    own = Path(__file__).parent / "bin" / "mpf"
    found = str(own) if own.exists() else shutil.which("mpf")
    if found is None:
        raise FileNotFoundError("the program mpf is neither in the package nor in PATH")
    return found


def command(arguments: Sequence[str]) -> list[str]:
    """The command line of the program with these arguments."""
    return [find(), *arguments]


def start(arguments: Sequence[str]) -> subprocess.Popen[str]:
    """Starts the program; its stdout and stderr are pipes. `tap` and `replay` end with this
    process: then their stdout has no reader."""
    return subprocess.Popen(
        command(arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def first_line(process: subprocess.Popen[str], stream: IO[str], patience: float) -> str:
    """The first line of its stdout or stderr; empty if it ends before.

    Kills the program, and raises Error, if it takes longer than `patience` [s].
    """
    late = threading.Event()

    def give_up() -> None:
        late.set()
        process.kill()

    limit = threading.Timer(patience, give_up)
    limit.start()
    try:
        line = stream.readline()
    finally:
        limit.cancel()
        limit.join()
    if late.is_set():
        text = f"the program mpf has written nothing within {patience:g} s"
        raise Error("\n".join([text, error_of(process)]).strip())
    return line


def stop(process: subprocess.Popen[str]) -> None:
    """Ends the program, and waits until it has ended. One that is stopped is killed."""
    if process.poll() is None:
        process.terminate()
    try:
        process.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


def error_of(process: subprocess.Popen[str]) -> str:
    """What a program that has failed has written to stderr."""
    return process.communicate()[1].strip()


def main() -> None:
    """The console script `mpf`: replaces this process by the program."""
    path = find()
    os.execv(path, [path, *sys.argv[1:]])
