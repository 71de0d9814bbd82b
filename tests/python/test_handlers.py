# SPDX-License-Identifier: MIT
"""mpf.Server: what may be a handler, and when."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable

import pytest
from conftest import PATIENCE

import mpf


def call(message: mpf.Int32 | mpf.Float64) -> float:
    with mpf.Client("tested", timeout=PATIENCE) as client:
        return client.call(message, PATIENCE).value


class AsyncAdder:
    """Adds to the value of a request. It is an object, and false."""

    def __bool__(self) -> bool:
        return False

    async def __call__(self, request: mpf.Int32) -> int:
        return request.value + 1


async def add(request: mpf.Int32) -> int:
    return request.value + 1


async def count(request: mpf.Int32) -> AsyncIterator[int]:
    yield request.value + 1


@pytest.mark.parametrize("handler", [AsyncAdder(), add, lambda request: add(request), count])
@pytest.mark.parametrize("isLater", [False, True])
def test_a_handler_may_be_anything_that_returns_an_awaitable(
    server: mpf.Server, handler: Callable[[mpf.Int32], object], isLater: bool
) -> None:
    server.on(mpf.Float64)(lambda request: request.value)
    if isLater:
        server.start()
        call(mpf.Float64())  # it runs, and without an event loop
    server.on(mpf.Int32)(handler)
    if not isLater:
        server.start()

    for value in range(3):
        assert call(mpf.Int32(value)) == value + 1
        assert call(mpf.Float64(value)) == value


def test_coroutines_that_come_later_run_at_the_same_time(server: mpf.Server) -> None:
    met = asyncio.Event()

    @server.on(mpf.Int32)
    def wait(request: mpf.Int32) -> object:
        return asyncio.wait_for(met.wait(), PATIENCE)

    @server.on(mpf.Float64)
    def end(request: mpf.Float64) -> None:
        met.set()

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        waiting = client.send(mpf.Int32())
        client.float64()
        assert getattr(waiting.wait(), "value") == 1


@pytest.mark.parametrize("error", [asyncio.CancelledError("away"), GeneratorExit("away")])
@pytest.mark.parametrize("hasLoop", [False, True])
def test_an_exception_that_ends_tasks_and_generators_reaches_the_client(
    server: mpf.Server, error: BaseException, hasLoop: bool
) -> None:
    @server.on(mpf.Int32)
    def fail(request: mpf.Int32) -> None:
        raise error

    if hasLoop:
        server.on(mpf.Float64)(add)
    with server.start():
        for _ in range(2):  # the server goes on
            with pytest.raises(mpf.StatusError, match=f"{type(error).__name__}: away"):
                call(mpf.Int32())
