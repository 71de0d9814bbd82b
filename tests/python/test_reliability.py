# SPDX-License-Identifier: MIT
"""Processes that die, many threads, cancelled tasks: every call ends, no reply reaches another
call, and nothing is left.

MPF_TEST_PYTHON_FACTOR multiplies the numbers: with 100, 10,000 processes are killed, and a million
messages sent.
"""

from __future__ import annotations

import asyncio
import collections
import gc
import logging
import multiprocessing
import os
import random
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import PATIENCE

import mpf

FACTOR = float(os.environ.get("MPF_TEST_PYTHON_FACTOR", "1"))
# Children start within milliseconds: they are forked by a process that has imported mpf.
PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(["mpf", "numpy", "test_reliability"])


def many(number: int) -> int:
    return max(1, int(number * FACTOR))


# ---- processes that are killed


def serve(backplane: str, number: int) -> None:
    """Replies to values with twice the value, and to arrays with the sum of their elements."""
    server = mpf.Server(f"victim{number}", backplane=backplane)
    server.on(mpf.Int32)(lambda request: request.value * 2)
    server.on(mpf.Float64Array)(lambda request: request.value * 2)
    server.run()


def ask(backplane: str, number: int) -> None:
    """Asks forever; ends with status 3 at a wrong reply."""
    with mpf.Client(f"victim{number}", backplane=backplane) as client:
        while call(client, random.randrange(1 << 30)) != "wrong":
            pass
    sys.exit(3)


def call(client: mpf.Client, value: int) -> str:
    """Returns what became of two requests."""
    try:
        if client.int32(value, timeout=PATIENCE).value != value * 2:
            return "wrong"
        array = np.full(5000, float(value))
        if not np.array_equal(client.float64_array(array, timeout=PATIENCE).value, array * 2):
            return "wrong"
    except mpf.TimedOut:
        return "timed out"
    except mpf.Error as error:
        return type(error).__name__
    return "replied"


class Observer:
    """Calls a server that is killed, in a thread, and holds views of replies while it dies."""

    def __init__(self, pair: int) -> None:
        self.outcomes: collections.Counter[str] = collections.Counter()
        self.error: BaseException | None = None
        self._client = mpf.Client(f"victim{pair}", timeout=PATIENCE)
        self._views: collections.deque[tuple[float, Any]] = collections.deque(maxlen=8)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self.outcomes[call(self._client, random.randrange(1 << 30))] += 1
                self._hold(float(self.outcomes["replied"]))
        except BaseException as error:
            self.error = error

    def _hold(self, value: float) -> None:
        for expected, view in self._views:
            assert view.min() == view.max() == expected
        try:
            reply = self._client.float64_array(np.full(5000, value))
        except mpf.NoReply:
            return
        self._views.append((2 * value, reply.value))

    def wait_for_replies(self, number: int) -> None:
        enough = self.outcomes["replied"] + number
        while self.outcomes["replied"] < enough and self.error is None:
            time.sleep(0.01)

    def end(self) -> None:
        self._stop.set()
        self._thread.join()
        self._client.close()


class Victims:
    """Servers and clients, each of which is replaced when it was killed."""

    def __init__(self, backplane: str, pairs: int) -> None:
        self._backplane = backplane
        roles = [(role, pair) for pair in range(pairs) for role in (serve, ask)]
        self._running = {role: self._start(*role) for role in roles}

    def _start(self, role: Callable[..., None], pair: int) -> Any:
        process = PROCESSES.Process(target=role, args=(self._backplane, pair), daemon=True)
        process.start()
        return process

    def kill_one(self) -> None:
        role, process = random.choice(list(self._running.items()))
        assert process.exitcode is None, "a process has ended by itself"
        process.kill()
        process.join()
        process.close()
        self._running[role] = self._start(*role)

    def end(self) -> None:
        for process in self._running.values():
            process.kill()
            process.join()


@pytest.mark.skipif(sys.platform != "linux", reason="forkserver")
def test_calls_end_while_processes_are_killed(backplane: str) -> None:
    victims = Victims(backplane, pairs=2)
    observers = [Observer(pair) for pair in range(2)]
    try:
        for _ in range(many(100)):
            time.sleep(random.expovariate(1 / 0.005))
            victims.kill_one()
        for observer in observers:
            observer.wait_for_replies(10)  # the survivors go on
    finally:
        for observer in observers:
            observer.end()
        victims.end()
    for observer in observers:
        print(observer.outcomes)
        assert set(observer.outcomes) <= {"replied", "NeverTaken", "OutcomeUnknown", "NotConnected"}
        assert observer.error is None


# ---- threads and tasks


def test_threads_share_a_client_and_each_gets_its_reply(doubler: mpf.Server) -> None:
    wrong: list[int] = []
    with mpf.Client("doubler", timeout=PATIENCE) as client:

        def work(first: int) -> None:
            for value in range(first, first + many(1250)):
                if client.int32(value).value != 2 * value:
                    wrong.append(value)

        threads = [threading.Thread(target=work, args=(n << 24,)) for n in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not wrong


async def test_cancelled_tasks_leave_nothing_and_others_get_their_replies() -> None:
    server = mpf.Server("slow", queue_size=2000)

    @server.on(mpf.Int32)
    async def wait(request: mpf.Int32) -> int:
        await asyncio.sleep(random.random() * 0.01)
        return request.value * 2

    async def ask(value: int) -> bool:
        return (await client.int32(value)).value == 2 * value

    with server.start():
        client = mpf.AsyncClient("slow", timeout=PATIENCE)
        for _ in range(many(5)):
            tasks = [asyncio.ensure_future(ask(value)) for value in range(1000)]
            for task in random.sample(tasks, 700):
                await asyncio.sleep(random.random() * 1e-4)
                task.cancel()
            results = await asyncio.gather(*tasks, return_exceptions=True)
            kinds = collections.Counter(
                one if isinstance(one, bool) else type(one).__name__ for one in results
            )
            assert set(kinds) <= {True, "CancelledError"}
            assert kinds[True] >= 300
        assert not client._waiting
        client.close()


# ---- memory


def pages() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


@pytest.fixture
def quiet() -> Iterator[None]:
    """Nothing is logged: pytest would keep the records."""
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


def test_calls_leak_neither_objects_nor_memory(quiet: None) -> None:
    # Beside other processes, threads that poll would wait for each other.
    server = mpf.Server("doubler", wait="block")
    server.on(mpf.Message)(lambda request: request.value * 2)
    kinds = [mpf.Int32, mpf.Float64Array, mpf.Char8Array]
    array = np.zeros(1000)
    client = mpf.Client("doubler", timeout=PATIENCE, wait="block")
    with server.start(), client:

        def work(rounds: int) -> None:
            for number in range(rounds):
                client.int32(number)
                client.float64_array(array)
                with pytest.raises(mpf.StatusError):
                    client.char8_array("text")
                with pytest.raises(ValueError, match="cmd"):
                    mpf.Float64Array([0.0], cmd=1 << 32)
            gc.collect()

        @server.on(mpf.Char8Array)
        def fail(request: mpf.Char8Array) -> None:
            raise mpf.StatusError("no", status=-2)

        work(300)  # caches are full then
        before = [sys.getrefcount(kind) for kind in kinds]  # each object refers to its class
        objects, blocks, used = len(gc.get_objects()), sys.getallocatedblocks(), pages()
        work(many(3334))
        assert [sys.getrefcount(kind) for kind in kinds] == before
        assert len(gc.get_objects()) - objects < 100
        assert sys.getallocatedblocks() - blocks < 500
        assert (pages() - used) * os.sysconf("SC_PAGE_SIZE") < 4 << 20
