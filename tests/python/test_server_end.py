# SPDX-License-Identifier: MIT
"""mpf.Server: what ends it, what ends its generators, and what does not."""

from __future__ import annotations

import asyncio
import concurrent.futures
import importlib
import signal
import sys
import threading
import types
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from conftest import PATIENCE

import mpf
from mpf import ending

LAYOUT = Path(__file__).parent.parent / "layout" / "v1_0"


def call(message: mpf.Int32) -> int:
    with mpf.Client("tested", timeout=PATIENCE) as client:
        return client.call(message, PATIENCE).value


@pytest.mark.parametrize("isCoroutine", [False, True])
def test_run_ends_when_another_thread_closes_the_server(
    server: mpf.Server, isCoroutine: bool
) -> None:
    if isCoroutine:

        @server.on(mpf.Int32)
        async def answer(request: mpf.Int32) -> int:
            return 5
    else:
        server.on(mpf.Int32)(lambda request: 5)

    with concurrent.futures.ThreadPoolExecutor() as threads:
        running = threads.submit(server.run)
        call(mpf.Int32())
        server.close()

        assert running.result() is None


@pytest.mark.parametrize("isCoroutine", [False, True])
def test_a_handler_may_close_the_server(server: mpf.Server, isCoroutine: bool) -> None:
    if isCoroutine:

        @server.on(mpf.Int32)
        async def end(request: mpf.Int32) -> int:
            server.close()
            return 5
    else:

        @server.on(mpf.Int32)
        def end(request: mpf.Int32) -> int:
            server.close()
            return 5

    server.start()
    with mpf.Client("tested", timeout=PATIENCE) as client:
        assert client.int32().value == 5
    server.close()
    with pytest.raises(mpf.Error, match="closed"):
        server.start()


def test_a_coroutine_that_closes_the_server_ends_first(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    async def end(request: mpf.Int32) -> int:
        server.close()
        for _ in range(10):
            await asyncio.sleep(0.001)
        return 5

    server.start()
    with mpf.Client("tested", timeout=PATIENCE) as client:
        assert client.int32().value == 5
    server.close()


@pytest.mark.parametrize("isFunction", [False, True])
def test_a_thread_of_the_event_loop_may_close_the_server(
    server: mpf.Server, isFunction: bool
) -> None:
    async def end(request: mpf.Int32) -> None:
        await asyncio.to_thread(server.close)

    server.on(mpf.Int32)((lambda request: end(request)) if isFunction else end)
    with concurrent.futures.ThreadPoolExecutor() as threads:
        running = threads.submit(server.run)
        with pytest.raises(mpf.Refused):
            call(mpf.Int32())

        assert running.result() is None


def test_run_keeps_a_handler_of_sigterm_that_a_handler_of_requests_has_set(
    server: mpf.Server,
) -> None:
    def own(number: int, frame: object) -> None: ...

    @server.on(mpf.Int32)
    def take_over(request: mpf.Int32) -> int:
        signal.signal(signal.SIGTERM, own)
        server.interrupt()
        return 5

    before = signal.getsignal(signal.SIGTERM)
    try:
        with concurrent.futures.ThreadPoolExecutor() as threads:
            calling = threads.submit(call, mpf.Int32())
            server.run()
            assert calling.result() == 5

        assert signal.getsignal(signal.SIGTERM) is own
    finally:
        signal.signal(signal.SIGTERM, before)


def test_an_async_generator_that_closes_the_server_ends(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    async def count(request: mpf.Int32) -> AsyncIterator[int]:
        while True:
            yield 1
            server.close()
            await asyncio.sleep(0.001)

    with mpf.Client("tested") as client:
        running = threading.Thread(target=server.run)
        running.start()
        assert next(client.subscribe(mpf.Int32(), timeout=PATIENCE)).value == 1
        running.join()


@pytest.mark.parametrize("isAsync", [False, True])
def test_a_generator_without_end_ends_with_its_client_and_with_the_server(
    server: mpf.Server, isAsync: bool
) -> None:
    ended = threading.Semaphore(0)
    if isAsync:

        @server.on(mpf.Int32)
        async def count(request: mpf.Int32) -> AsyncIterator[int]:
            try:
                while True:
                    yield 1
            finally:
                ended.release()
    else:

        @server.on(mpf.Int32)
        def count(request: mpf.Int32) -> Iterator[int]:
            try:
                while True:
                    yield 1
            finally:
                ended.release()

    server.start()
    with mpf.Client("tested", timeout=PATIENCE) as client:
        next(client.subscribe(mpf.Int32()))
    assert ended.acquire(timeout=PATIENCE)
    with mpf.Client("tested", timeout=PATIENCE) as client:
        next(client.subscribe(mpf.Int32()))
        server.close()
    assert ended.acquire(timeout=PATIENCE)


def test_an_async_generator_that_waits_ends_with_its_client(server: mpf.Server) -> None:
    ended = threading.Semaphore(0)

    @server.on(mpf.Int32)
    async def wait(request: mpf.Int32) -> AsyncIterator[int]:
        yield 1
        try:
            await asyncio.Event().wait()
        finally:
            ended.release()

    with server.start():
        with mpf.Client("tested", timeout=PATIENCE) as client:
            next(client.subscribe(mpf.Int32()))
        assert ended.acquire(timeout=PATIENCE)


@pytest.mark.parametrize("error", [SystemExit("ends"), KeyboardInterrupt()])
@pytest.mark.parametrize("isCoroutine", [False, True])
def test_a_handler_that_ends_the_thread_of_a_server_closes_it(
    server: mpf.Server,
    caplog: pytest.LogCaptureFixture,
    error: BaseException,
    isCoroutine: bool,
) -> None:
    if isCoroutine:

        @server.on(mpf.Int32)
        async def end(request: mpf.Int32) -> None:
            raise error
    else:

        @server.on(mpf.Int32)
        def end(request: mpf.Int32) -> None:
            raise error

    server.start()
    with mpf.Client("tested", timeout=PATIENCE) as client:
        with pytest.raises(mpf.Refused):
            client.int32()
        while client.connected:
            with pytest.raises(mpf.Error):
                client.int32(timeout=0.01)
    server.close()

    assert "the server is closed" in caplog.text
    assert f"in end\n    raise error\n{type(error).__name__}" in caplog.text


def test_a_handler_that_exits_ends_run(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: sys.exit(7))

    with concurrent.futures.ThreadPoolExecutor() as threads:
        asking = threads.submit(call, mpf.Int32())
        with pytest.raises(SystemExit):
            server.run()
        assert isinstance(asking.exception(), mpf.Refused)


class Stuck:
    """A server whose thread does not end."""

    def __init__(self) -> None:
        self._thread = self
        self.isClosed = False
        self.waited = 0.0

    def _interrupt(self) -> None: ...

    def join(self, timeout: float) -> None:
        self.waited = timeout

    def _close(self) -> None:
        self.isClosed = True


def test_the_end_of_a_program_waits_for_all_servers_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stuck = [Stuck() for _ in range(8)]
    clock = types.SimpleNamespace(monotonic=lambda: 100 + sum(one.waited for one in stuck))
    monkeypatch.setattr(ending, "_servers", stuck)
    monkeypatch.setattr(ending, "time", clock)

    ending._close_all()

    assert sum(one.waited for one in stuck) == 1
    assert all(one.isClosed for one in stuck)


def test_start_refuses_a_server_that_runs(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: 5)
    running = threading.Thread(target=server.run)
    running.start()
    call(mpf.Int32())

    with pytest.raises(RuntimeError, match="runs already"):
        server.start()

    assert call(mpf.Int32()) == 5
    server.close()
    running.join()


def test_a_message_without_a_class_is_refused(server: mpf.Server, backplane: str) -> None:
    """Any program of the host may send one. The peer builds it byte by byte."""
    sys.path.insert(0, str(LAYOUT))
    client, messages, party, reader = map(
        importlib.import_module, ("client", "messages", "party", "reader")
    )
    server.on(mpf.Int32)(lambda request: 5)
    with server.start():
        peer = client.Client(reader.Layout(LAYOUT / "layout.md"), backplane)
        connection = peer.connect("tested")
        party.run_until(lambda: connection.is_open, peer)
        number = connection.send(messages.REQUEST_FATE, messages.request_fate(0, 1))
        party.run_until(lambda: connection.received, peer)
        [fate] = connection.received
        peer.close()

        assert messages.value(fate) == (messages.REFUSED, number)
        assert call(mpf.Int32()) == 5
