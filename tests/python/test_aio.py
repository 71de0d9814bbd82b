# SPDX-License-Identifier: MIT
"""mpf.AsyncClient: calls, cancellation, subscriptions in an event loop."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator

import pytest
from conftest import PATIENCE

import mpf


async def test_a_call_returns_the_reply(doubler: mpf.Server) -> None:
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        reply = await client.call(mpf.Int32(21))

    assert reply.value == 42


async def test_calls_run_at_the_same_time(doubler: mpf.Server) -> None:
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        replies = await asyncio.gather(*(client.call(mpf.Int32(n)) for n in range(90)))

    assert [reply.value for reply in replies] == [2 * n for n in range(90)]


async def test_an_absent_server_is_not_connected() -> None:
    async with mpf.AsyncClient("nobody", timeout=PATIENCE) as client:
        with pytest.raises(mpf.NotConnected, match="nobody"):
            await client.call(mpf.Int32(), timeout=0.01)


async def test_nan_is_not_a_time(doubler: mpf.Server) -> None:
    async with (
        mpf.AsyncClient("nobody") as absent,
        mpf.AsyncClient("doubler", timeout=PATIENCE) as client,
    ):
        [request] = await client.send_many([mpf.Int32(1)])
        await request.wait()
        for act in (
            absent.wait_connected(math.nan),
            absent.call(mpf.Int32(), math.nan),
            absent.send_many([mpf.Int32()], math.nan),
            anext(absent.subscribe(mpf.Int32(), timeout=math.nan)),
            request.next(math.nan),
        ):
            with pytest.raises(ValueError, match="timeout: NaN is not a time"):
                await act


async def test_a_server_that_starts_later_is_found() -> None:
    async with mpf.AsyncClient("late", timeout=PATIENCE) as client:
        calling = asyncio.ensure_future(client.call(mpf.Int32(1)))
        await asyncio.sleep(0)
        with mpf.Server("late") as server:
            server.on(mpf.Int32)(lambda request: request.value + 1)
            server.start()
            assert (await calling).value == 2


@pytest.fixture
async def silent() -> AsyncIterator[tuple[mpf.Server, list[mpf.Message], asyncio.Event]]:
    """A server that keeps its requests."""
    server = mpf.Server("silent")
    kept: list[mpf.Message] = []
    came = asyncio.Event()
    released = asyncio.Event()

    @server.on(mpf.Int32)
    async def keep(request: mpf.Int32) -> None:
        kept.append(request)
        came.set()
        await released.wait()

    serving = asyncio.ensure_future(server.serve())
    yield server, kept, came
    kept.clear()
    server.interrupt()
    await serving
    server.close()


Silent = tuple[mpf.Server, list[mpf.Message], asyncio.Event]


async def test_a_call_times_out(silent: Silent) -> None:
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        assert await client.wait_connected(PATIENCE)
        timeout = 0.3
        late: TimeoutError = mpf.Expired()
        while isinstance(late, mpf.Expired):  # the server was too late, as on a busy host
            with pytest.raises(TimeoutError) as caught:
                await client.call(mpf.Int32(), timeout=timeout)
            late = caught.value
            timeout *= 2

    assert isinstance(late, mpf.TimedOut)
    assert silent[1]


class WithoutTimer(mpf.AsyncClient):
    """Its calls see the end of their time before the connection does."""

    def _set_timer(self) -> None:
        pass


async def test_a_call_that_expires_delays_no_reply_to_another(server: mpf.Server) -> None:
    async with WithoutTimer("tested", timeout=math.inf) as client:
        waiting = asyncio.ensure_future(client.call(mpf.Int32(1)))
        request = await asyncio.to_thread(server._receive, PATIENCE)
        assert request is not None
        with pytest.raises(mpf.Expired):  # nobody takes it
            await client.call(mpf.Int32(2), timeout=0.01)

        server.reply(request, mpf.Int32(3))

        assert (await asyncio.wait_for(waiting, PATIENCE)).value == 3


async def test_a_cancelled_task_cancels_its_request(silent: Silent, backplane: str) -> None:
    server, kept, came = silent
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        calling = asyncio.ensure_future(client.call(mpf.Int32()))
        await came.wait()
        calling.cancel()
        with pytest.raises(asyncio.CancelledError):
            await calling
        assert not client._waiting
        server.reply(kept[0], mpf.Int32(5))  # too late: it is dropped

        other = asyncio.ensure_future(client.call(mpf.Int32(7)))
        came.clear()
        await came.wait()
        server.reply(kept[1], mpf.Int32(8))
        assert (await other).value == 8


async def test_asyncio_timeouts_work(silent: Silent) -> None:
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        calling = asyncio.ensure_future(client.call(mpf.Int32()))
        await silent[2].wait()
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(calling, 0.01)

        assert calling.cancelled()
        assert not client._waiting


async def test_closing_ends_calls(silent: Silent) -> None:
    client = mpf.AsyncClient("silent", timeout=PATIENCE)
    calling = asyncio.ensure_future(client.call(mpf.Int32()))
    await silent[2].wait()
    client.close()

    with pytest.raises(mpf.Error):
        await calling


async def test_calls_by_type(doubler: mpf.Server) -> None:
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        assert (await client.int32(2, address=3)).address == 3
        assert (await client.float64(1.5)).value == 3.0
        assert (await client.int32_array([1, 2])).value.tolist() == [2, 4]
        assert (await client.float64_array([0.5])).value.tolist() == [1.0]
        assert (await client.char8_array("ab")).text == "abab"


async def test_a_subscription_whose_first_reply_is_late_times_out(silent: Silent) -> None:
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        assert await client.wait_connected(PATIENCE)
        with pytest.raises(TimeoutError):
            await anext(client.subscribe(mpf.Int32(), timeout=0.2))


async def test_a_wait_for_the_first_reply_may_be_cancelled(silent: Silent) -> None:
    server, requests, came = silent
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Int32())
        waiting = asyncio.ensure_future(anext(replies))
        await came.wait()
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        server.reply(requests[0], mpf.Int32(5))
        server.reply(requests[0], mpf.Int32(6))

        assert [(await anext(replies)).value, (await anext(replies)).value] == [5, 6]
    assert len(requests) == 1


async def test_a_subscription_iterates(doubler: mpf.Server) -> None:
    doubler.on(mpf.Float64)(lambda request: (float(n) for n in range(4)))
    values = []
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        async with client.subscribe(mpf.Float64()) as replies:
            async for reply in replies:
                values.append(reply.value)
                if len(values) == 4:
                    break

    assert values == [0.0, 1.0, 2.0, 3.0]


async def test_a_subscription_is_renewed(doubler: mpf.Server) -> None:
    def serve() -> mpf.Server:
        server = mpf.Server("source")
        server.on(mpf.Int32)(lambda request: (n for n in (1, 2)))
        return server.start()

    first = serve()
    async with mpf.AsyncClient("source") as client, client.subscribe(mpf.Int32()) as replies:
        before = [(await anext(replies)).value for _ in range(2)]
        first.close()
        with serve():
            after = [(await anext(replies)).value for _ in range(2)]

    assert before == after == [1, 2]


@pytest.mark.parametrize("hasReply", [False, True])
async def test_another_task_may_close_a_subscription(silent: Silent, hasReply: bool) -> None:
    server, requests, came = silent
    async with mpf.AsyncClient("silent", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Int32())
        received: list[int] = []

        async def receive() -> None:
            async for reply in replies:
                received.append(reply.value)

        receiving = asyncio.ensure_future(receive())
        await came.wait()
        if hasReply:
            server.reply(requests[0], mpf.Int32(5))
            while not received:
                await asyncio.sleep(0)
        replies.close()
        await receiving

    assert received == ([5] if hasReply else [])


async def test_a_subscription_that_waits_for_its_server_may_be_closed() -> None:
    async with mpf.AsyncClient("absent") as client:
        replies = client.subscribe(mpf.Int32())
        receiving = asyncio.ensure_future(anext(replies, None))
        while not client._waiting:
            await asyncio.sleep(0)
        replies.close()

        assert await receiving is None


async def test_a_thousand_subscriptions_of_one_client() -> None:
    sources = []
    # room for a thousand replies of two slots beyond the first ones
    with mpf.Server("source", queue_size=4000) as server:

        @server.on(mpf.Float64)
        def keep(request: mpf.Float64) -> mpf.Float64:
            sources.append(request)
            return mpf.Float64(request.value)

        server.start()
        async with mpf.AsyncClient("source", timeout=PATIENCE) as client:
            subscriptions = [client.subscribe(mpf.Float64(float(n))) for n in range(1000)]
            first = [(await anext(each)).value for each in subscriptions]
            for source in sources:
                server.reply(source, mpf.Float64(source.value + 0.5))
            second = [(await anext(each)).value for each in subscriptions]
        sources.clear()

    assert first == [float(n) for n in range(1000)]
    assert second == [n + 0.5 for n in range(1000)]


def test_a_client_belongs_to_one_loop(doubler: mpf.Server) -> None:
    client = mpf.AsyncClient("doubler", timeout=PATIENCE)

    async def use() -> None:
        await client.call(mpf.Int32())

    asyncio.run(use())
    with pytest.raises(RuntimeError, match="another event loop"):
        asyncio.run(use())
