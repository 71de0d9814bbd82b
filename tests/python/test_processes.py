# SPDX-License-Identifier: MIT
"""Processes that fork or end while threads and tasks use the package, and sub-interpreters."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from conftest import PATIENCE, may_fork_beside_threads, needs_mpf

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


def prepared(body: str) -> str:
    """A program with a server "ended", whose handlers begin with `started()`."""
    return f"""
import asyncio, os, signal, sys, threading, time, mpf
server = mpf.Server("ended")
begun = threading.Event()
def started():
    print("started", flush=True)
    begun.set()
{body}
"""


FINISHES = """
@server.on(mpf.Int32)
def finish(request):
    started()
    while not server._isFinishing:
        time.sleep(0.001)
    return request.value
"""
FINISHES_LATER = """
@server.on(mpf.Int32)
async def finish(request):
    started()
    while not server._isFinishing:
        await asyncio.sleep(0.001)
    await asyncio.sleep(0.001)
    return request.value
"""
FINISHES_IN_LATER_LOOP = FINISHES_LATER + "server.on(mpf.Int32)(lambda request: finish(request))\n"
NEVER_ENDS = """
@server.on(mpf.Int32)
def wait(request):
    started()
    time.sleep(1e6)
"""


@pytest.fixture
def program() -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Starts programs of Python, which end with the test."""
    with contextlib.ExitStack() as stack:

        def start(text: str) -> subprocess.Popen[str]:
            process = subprocess.Popen(
                [sys.executable, "-X", "faulthandler", "-c", text],
                stdout=subprocess.PIPE,
                text=True,
            )
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield start


def line_of(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


@pytest.mark.parametrize("handler", [FINISHES, FINISHES_LATER, FINISHES_IN_LATER_LOOP])
def test_sigterm_lets_handlers_reply_and_ends_run(
    handler: str, program: Callable[[str], subprocess.Popen[str]]
) -> None:
    process = program(prepared(handler + "server.run()\nprint('end')"))
    with mpf.Client("ended", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(5))
        assert line_of(process) == "started\n"
        process.terminate()

        assert getattr(request.wait(), "value") == 5
        assert process.wait() == 0
    assert line_of(process) == "end\n"


def test_ctrl_c_ends_a_handler_and_run(program: Callable[[str], subprocess.Popen[str]]) -> None:
    process = program(
        prepared(
            "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
            f"{NEVER_ENDS}server.run()\nprint('end')"
        )
    )
    with mpf.Client("ended", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(5))
        assert line_of(process) == "started\n"
        process.send_signal(signal.SIGINT)

        with pytest.raises(mpf.Refused):
            request.wait()
        assert process.wait() == 0
    assert line_of(process) == "end\n"


def test_sigterm_ends_generators(program: Callable[[str], subprocess.Popen[str]]) -> None:
    process = program(
        prepared(
            """
@server.on(mpf.Int32)
async def count(request):
    try:
        while True:
            yield 1
            await asyncio.sleep(1e6)
    finally:
        print("closed")
server.run()
"""
        )
    )
    with mpf.Client("ended") as client:
        next(client.subscribe(mpf.Int32(), timeout=PATIENCE))
        process.terminate()

        assert process.wait() == 0
    assert line_of(process) == "closed\n"


def test_a_second_sigterm_ends_the_process(
    program: Callable[[str], subprocess.Popen[str]],
) -> None:
    process = program(
        prepared(
            """
@server.on(mpf.Int32)
def stuck(request):
    started()
    while server._isFinishing is False:
        time.sleep(0.001)
    started()
    time.sleep(1e6)
server.run()
"""
        )
    )
    with mpf.Client("ended", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(), timeout=PATIENCE)
        for _ in range(2):
            assert line_of(process) == "started\n"
            process.terminate()
        assert process.wait() == -signal.SIGTERM
        with pytest.raises(mpf.OutcomeUnknown):
            request.wait()


def test_a_program_keeps_its_handler_of_sigterm(
    program: Callable[[str], subprocess.Popen[str]],
) -> None:
    process = program(
        prepared(
            "signal.signal(signal.SIGTERM, lambda *_: sys.exit(9))\n"
            f"{NEVER_ENDS}server.run()"
        )
    )
    with mpf.Client("ended", timeout=PATIENCE) as client:
        client.send(mpf.Int32())
        assert line_of(process) == "started\n"
        process.terminate()
        assert process.wait() == 9


@needs_mpf
@pytest.mark.parametrize("end", ["", "sys.exit(0)", "del server"])
def test_a_program_that_ends_closes_its_servers(
    end: str, program: Callable[[str], subprocess.Popen[str]]
) -> None:
    process = program(
        prepared(
            f"""
other = mpf.Server("other")
server.on(mpf.Int32)(lambda request: 5)
server.start()
with mpf.Client("ended", timeout={PATIENCE}) as client:
    client.int32()
{end}
"""
        )
    )
    assert process.wait() == 0
    assert mpf.servers() == []


@may_fork_beside_threads
def test_the_child_of_a_handler_may_exit(program: Callable[[str], subprocess.Popen[str]]) -> None:
    process = program(
        prepared(
            """
@server.on(mpf.Int32)
def fork(request):
    child = os.fork()
    if child == 0:
        sys.exit(7)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
server.run()
"""
        )
    )
    with mpf.Client("ended", timeout=PATIENCE) as client:
        assert client.int32().value == 7
    process.terminate()
    assert process.wait() == 0


def test_a_program_ends_while_a_handler_of_its_server_does_not(
    program: Callable[[str], subprocess.Popen[str]],
) -> None:
    process = program(prepared(f"{NEVER_ENDS}server.start()\nbegun.wait()"))
    with mpf.Client("ended", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32())
        assert line_of(process) == "started\n"
        process.wait()
        with pytest.raises(mpf.OutcomeUnknown):
            request.wait()


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
