# SPDX-License-Identifier: MIT
"""Each test has a backplane of its own, which is empty at the end."""

from __future__ import annotations

import contextlib
import gc
import os
import secrets
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import mpf

#: Patience for what must happen; never a limit of what is tested.
PATIENCE = 120.0

PROGRAMS = Path(os.environ["MPF_TEST_PROGRAMS"])


@pytest.fixture(autouse=True)
def backplane(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    name = f"py{os.getpid()}-{secrets.token_hex(4)}"
    monkeypatch.setenv("MPF_BACKPLANE", name)
    monkeypatch.setenv("PATH", f"{PROGRAMS}:{os.environ['PATH']}")
    yield name
    gc.collect()
    # What killed processes leave is removed by the next one; what living ones leave is a defect.
    subprocess.run([PROGRAMS / "mpf", "clean"], stdout=subprocess.DEVNULL, check=True)
    left = [file.name for file in Path("/dev/shm").glob(f"mpf.{name}.*")]
    for file in left:
        Path("/dev/shm", file).unlink(missing_ok=True)
    assert not left


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts programs, which end with the test."""
    with contextlib.ExitStack() as stack:

        def run(*command: str | Path) -> subprocess.Popen[str]:
            process = subprocess.Popen(
                [str(part) for part in command], stdout=subprocess.DEVNULL, text=True
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        yield run


@pytest.fixture
def doubler() -> Iterator[mpf.Server]:
    """A server that replies with twice the value."""
    server = mpf.Server("doubler")

    @server.on(mpf.Message)
    def double(request: mpf.Int32) -> object:
        return request.value * 2

    with server.start():
        yield server
