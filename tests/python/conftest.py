# SPDX-License-Identifier: MIT
"""Each test has a backplane of its own, which is empty at the end."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import secrets
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import pytest

import mpf

#: Patience for what must happen; never a limit of what is tested.
PATIENCE = 120.0

PROGRAMS = Path(os.environ["MPF_TEST_PROGRAMS"])
HAS_MPF = (PROGRAMS / "mpf").exists()  # builds with a sanitizer lack it
#: The allocator of AddressSanitizer in g++ 12 stays locked in a child if another thread of its
#: parent used it during the fork.
may_fork_beside_threads = pytest.mark.skipif(
    hasattr(ctypes.CDLL(None), "__asan_init"),
    reason="AddressSanitizer may hang after a fork beside other threads",
)
needs_mpf = pytest.mark.skipif(not HAS_MPF, reason="the program mpf was not built")


T = TypeVar("T")


def again_if_late(ask: Callable[[float], T], timeout: float, late: type[TimeoutError]) -> T:
    """Asks again with a longer timeout when the server was too late, as on a busy host."""
    while True:
        try:
            return ask(timeout)
        except late:
            timeout *= 2


def pytest_sessionstart() -> None:
    """Ctrl-C interrupts, also where the caller ignores it, as a shell does for background jobs."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """With AddressSanitizer: fails when memory was lost, and prints where it was allocated."""
    loses_memory = getattr(ctypes.CDLL(None), "__lsan_do_recoverable_leak_check", None)
    gc.collect()
    if loses_memory is not None and loses_memory() != 0:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture(autouse=True)
def backplane(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    name = f"py{os.getpid()}-{secrets.token_hex(4)}"
    monkeypatch.setenv("MPF_BACKPLANE", name)
    monkeypatch.setenv("PATH", f"{PROGRAMS}:{os.environ['PATH']}")
    yield name
    gc.collect()
    # What killed processes leave is removed by the next one; what living ones leave is a defect.
    if HAS_MPF:
        subprocess.run([PROGRAMS / "mpf", "clean"], stdout=subprocess.DEVNULL, check=True)
    left = [file.name for file in Path("/dev/shm").glob(f"mpf.{name}.*")]
    for file in left:
        Path("/dev/shm", file).unlink(missing_ok=True)
    assert not left or not HAS_MPF


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
def server() -> Iterator[mpf.Server]:
    """A server that a test starts itself."""
    with mpf.Server("tested") as server:
        yield server


@pytest.fixture
def doubler() -> Iterator[mpf.Server]:
    """A server that replies with twice the value."""
    server = mpf.Server("doubler")

    @server.on(mpf.Message)
    def double(request: mpf.Int32) -> object:
        return request.value * 2

    with server.start():
        yield server


class Silent:
    """A server that keeps its requests until the test ends them."""

    def __init__(self) -> None:
        self.server = mpf.Server("silent")
        self.requests: list[mpf.Message] = []
        self.came = threading.Semaphore(0)
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self) -> None:
        while not self.server._take_interrupt():
            request = self.server._receive(PATIENCE)
            if request is not None:
                self.requests.append(request)
                self.came.release()

    def close(self) -> None:
        self.server.interrupt()
        self.thread.join()
        self.server.close()
        self.requests.clear()


@pytest.fixture
def silent() -> Iterator[Silent]:
    server = Silent()
    yield server
    server.close()
