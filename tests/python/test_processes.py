# SPDX-License-Identifier: MIT
"""Processes that fork or end while threads and tasks use the package, and sub-interpreters."""

from __future__ import annotations

import asyncio
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import PATIENCE, may_fork_beside_threads

import mpf


def run(program: str, backplane: str) -> str:
    """Runs a program of Python, and returns what it printed."""
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-W", "ignore", "-c", program],
        env={**os.environ, "MPF_BACKPLANE": backplane},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


ENDS = {
    "a daemon thread waits for a reply": """
        def wait():
            client.call(mpf.Float64(), timeout=1e6)
        for _ in range(4):
            threading.Thread(target=wait, daemon=True).start()
        while client.int32().value < 4:
            pass
        """,
    "a daemon thread calls without a pause": """
        def ask():
            while True:
                client.int32(1)
        for _ in range(4):
            threading.Thread(target=ask, daemon=True).start()
        client.int32(1)
        """,
    "a daemon thread calls with large arrays": """
        def ask():
            while True:
                client.int32_array(range(100_000))
        for _ in range(4):
            threading.Thread(target=ask, daemon=True).start()
        client.int32_array(range(100_000))
        """,
    "a server runs in its thread": """
        served = mpf.Server("other")
        served.on(mpf.Int32)(lambda request: None)
        served = served.start()
        with mpf.Client("other") as other:
            other.int32(1)
        """,
    "a view and a subscription are still there": """
        view = client.call(mpf.Float64Array([1.0] * 1000)).value
        subscription = client.subscribe(mpf.Int32(1))
        next(subscription)
        """,
    "a task waits": """
        import asyncio
        async def main():
            waiting = mpf.AsyncClient("silent")
            task = asyncio.ensure_future(waiting.call(mpf.Float64(), 1e6))
            await asyncio.sleep(0)
            sys.exit(0)
        asyncio.run(main())
        """,
}


@pytest.fixture
def silent() -> Iterator[mpf.Server]:
    """Does not reply to a Float64, replies to an Int32 with the number of these, and returns other
    messages."""
    server = mpf.Server("silent")
    held: list[mpf.Message] = []

    @server.on(mpf.Float64)
    async def hold(request: mpf.Float64) -> object:
        held.append(request)
        return await asyncio.get_running_loop().create_future()

    server.on(mpf.Int32)(lambda request: len(held))
    server.on(mpf.Message)(lambda request: None)
    with server.start():
        yield server


@pytest.mark.parametrize("ending", ENDS)
def test_a_program_may_end_while(ending: str, silent: mpf.Server, backplane: str) -> None:
    lines = [line.removeprefix(8 * " ") for line in ENDS[ending].splitlines()]
    start = f'import sys, threading, mpf\nclient = mpf.Client("silent", timeout={PATIENCE})\n'
    assert run(start + "\n".join(lines) + '\nprint("end")\n', backplane) == "end\n" or (
        "sys.exit" in ENDS[ending]
    )


FORKS = """
import os, sys, threading, mpf
client = mpf.Client("doubler", timeout=PATIENCE, wait="block")
busy = threading.Thread(target=lambda: [client.int32(1) for _ in range(2000)])
busy.start()
for _ in range(20):
    child = os.fork()
    if child == 0:
        try:
            client.int32(1)
        except RuntimeError:
            with mpf.Client("doubler", timeout=PATIENCE) as own:
                value = own.int32(21).value
            END
        os._exit(2)
    assert os.waitpid(child, 0)[1] == 0
busy.join()
"""


@may_fork_beside_threads
@pytest.mark.parametrize("end", ["sys.exit(value != 42)", "os._exit(value != 42)"])
def test_a_forked_child_makes_objects_of_its_own(
    end: str, doubler: mpf.Server, backplane: str
) -> None:
    run(FORKS.replace("END", end).replace("PATIENCE", str(PATIENCE)), backplane)


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_multiprocessing_works(method: str, doubler: mpf.Server, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        f"""
import multiprocessing, mpf

def ask(value):
    with mpf.Client("doubler", timeout={PATIENCE}) as client:
        return client.int32(value).value

if __name__ == "__main__":
    with mpf.Client("doubler", timeout={PATIENCE}) as client:
        client.int32(1)
        with multiprocessing.get_context("{method}").Pool(2) as pool:
            assert pool.map(ask, range(10)) == [2 * value for value in range(10)]
        assert client.int32(4).value == 8
"""
    )
    subprocess.run([sys.executable, program], check=True)


def test_a_subinterpreter_is_refused_by_name() -> None:
    program = """
try:
    import _interpreters as interpreters  # from Python 3.13 on; it returns the exception
except ImportError:
    import _xxsubinterpreters as interpreters
try:
    print(interpreters.run_string(interpreters.create(), "import mpf"))
except interpreters.RunFailedError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    # From Python 3.12 on, CPython itself refuses it.
    assert re.search("mpf.* sub-?interpreter", done.stdout), done
