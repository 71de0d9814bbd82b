# SPDX-License-Identifier: MIT
"""send_many() of Client and AsyncClient: order, full queues, messages that are not sent."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from conftest import PATIENCE

import mpf


def test_many_requests_are_sent_in_order(doubler: mpf.Server) -> None:
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        requests = client.send_many(mpf.Int32(number) for number in range(50))
        values = [getattr(request.wait(), "value") for request in requests]

    assert values == [2 * number for number in range(50)]


@pytest.fixture
def short() -> Iterator[tuple[mpf.Server, mpf.Client]]:
    """A server with room for five requests, which does not run, and a client of it."""
    with (
        mpf.Server("short", queue_size=5) as server,
        mpf.Client("short", timeout=PATIENCE) as client,
    ):
        server.on(mpf.Message)(lambda request: None)
        while not client.wait_connected(0.01):
            server._receive(0)
        yield server, client


def test_many_requests_are_sent_as_far_as_there_is_room(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, client = short
    messages = [client.loan(mpf.Float64Array, 10_000) for _ in range(8)]
    for number, message in enumerate(messages):
        message.value[:] = number

    requests = client.send_many(messages)
    rest = messages[len(requests) :]
    with pytest.raises(mpf.QueueFull):
        client.send_many(rest)
    assert [message.value[0] for message in rest] == [5.0, 6.0, 7.0]
    server.start()
    replies = [request.wait() for request in requests]
    replies += [request.wait() for request in client.send_many(rest)]

    assert [getattr(reply, "value")[0] for reply in replies] == [float(n) for n in range(8)]


def test_nothing_is_sent_when_one_of_many_cannot_be(short: tuple[mpf.Server, mpf.Client]) -> None:
    server, client = short
    loaned = client.loan(mpf.Float64Array, 10_000)
    loaned.value[:] = 1.0

    with pytest.raises(TypeError, match="mpf.Int32"):
        client.send_many([loaned, 3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="sent"):
        client.send_many([loaned, loaned])

    assert loaned.value.sum() == 10_000
    assert server._receive(0) is None


def reply_to_all(server: mpf.Server) -> None:
    while (request := server._receive(0)) is not None:
        server.reply(request, request)


def test_a_client_that_does_not_wait_for_replies_may_send_on(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, client = short
    requests: list[mpf.Request] = []
    for number in range(0, 100, 4):
        requests.append(client.send(mpf.Int32(number)))
        requests += client.send_many(mpf.Int32(number + i) for i in (1, 2, 3))
        reply_to_all(server)

    assert [getattr(request.wait(), "value") for request in requests] == list(range(100))


def test_waiting_replies_leave_room_for_others(doubler: mpf.Server) -> None:
    """Larger replies than those of 24 bytes need memory of the connection."""
    requests: list[mpf.Request] = []
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        for _ in range(20):
            requests += client.send_many([mpf.Float64Array([0.5] * 100)] * 180)
            requests[-1].wait()

        assert {getattr(request.wait(), "value").sum() for request in requests} == {100.0}


def test_requests_that_the_program_dropped_take_no_room(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, client = short
    for number in range(100):
        client.send(mpf.Int32(number))
        reply_to_all(server)

    assert getattr(client.send(mpf.Int32(100)), "id") > 100


def test_a_client_that_does_not_wait_goes_on_with_the_next_server(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, client = short
    lost = client.send_many([mpf.Int32()] * 5)
    server.close()
    with mpf.Server("short") as second:
        second.on(mpf.Int32)(lambda request: request.value + 1)
        second.start()

        assert getattr(client.send(mpf.Int32(3)).wait(), "value") == 4
    for request in lost:
        with pytest.raises(mpf.NeverTaken):
            request.wait()


def test_many_requests_use_the_room_of_waiting_replies(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, client = short
    requests: list[mpf.Request] = []
    for _ in range(2):  # twice the size of the queue may have no reply
        requests += client.send_many([mpf.Int32(1)] * 4)
        reply_to_all(server)

    requests += client.send_many([mpf.Int32(2)] * 5)

    assert len(requests) == 13


async def test_a_coroutine_that_does_not_wait_for_replies_may_send_on(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, _ = short
    requests: list[mpf.AsyncRequest] = []
    async with mpf.AsyncClient("short", timeout=PATIENCE) as client:
        await connect(client, server)
        for number in range(100):
            requests += await client.send_many([mpf.Int32(number)])
            reply_to_all(server)

        values = [getattr(await request.wait(), "value") for request in requests]
    assert values == list(range(100))


def test_many_requests_need_a_connection() -> None:
    with mpf.Client("nobody") as client:
        assert client.send_many([]) == []
        with pytest.raises(mpf.NotConnected, match="nobody"):
            client.send_many([mpf.Int32()], timeout=0.01)


def test_many_requests_have_the_options_of_one(doubler: mpf.Server) -> None:
    doubler.on(mpf.Float64)(lambda request: (mpf.Int32(number) for number in (1, 2)))
    with mpf.Client("doubler") as client:
        requests = client.send_many([mpf.Float64()] * 2, PATIENCE, reply=mpf.Int32, further=1)
        replies = [(request.wait(), request.next(PATIENCE)) for request in requests]

    assert [[getattr(reply, "value") for reply in pair] for pair in replies] == [[1, 2]] * 2


async def test_a_coroutine_sends_many_requests_in_order(doubler: mpf.Server) -> None:
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        requests = await client.send_many(mpf.Int32(number) for number in range(50))
        replies = await asyncio.gather(*(request.wait() for request in requests))
        results = [request.result() for request in requests]

    assert [getattr(reply, "value") for reply in replies] == [2 * number for number in range(50)]
    assert results == replies


async def connect(client: mpf.AsyncClient, server: mpf.Server) -> None:
    """Connects to a server that does not run."""
    connecting = asyncio.ensure_future(client.wait_connected())
    while not connecting.done():
        server._receive(0)
        await asyncio.sleep(0)


async def test_closing_a_request_ends_the_wait_of_another_task(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, _ = short
    async with mpf.AsyncClient("short", timeout=float("inf")) as client:
        await connect(client, server)
        (request,) = await client.send_many([mpf.Int32()])
        waiting = asyncio.ensure_future(request.wait())
        await asyncio.sleep(0)

        request.close()

        with pytest.raises(mpf.Cancelled):
            await asyncio.wait_for(waiting, PATIENCE)


async def test_a_coroutine_sends_many_requests_as_far_as_there_is_room(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, _ = short
    messages = [mpf.Int32(number) for number in range(8)]
    async with mpf.AsyncClient("short", timeout=PATIENCE) as client:
        await connect(client, server)

        requests = await client.send_many(messages)
        with pytest.raises(mpf.QueueFull):
            await client.send_many(messages[5:])

        assert len(requests) == 5
        assert [request.result() for request in requests] == [None] * 5
        server.start()
        assert [getattr(await request.wait(), "value") for request in requests] == list(range(5))


async def test_a_coroutine_waits_for_the_connection_before_it_sends_many() -> None:
    async with mpf.AsyncClient("late", timeout=PATIENCE) as client:
        with pytest.raises(mpf.NotConnected, match="late"):
            await client.send_many([mpf.Int32()], timeout=0.01)
        sending = asyncio.ensure_future(client.send_many([mpf.Int32(1), mpf.Int32(2)]))
        await asyncio.sleep(0)
        with mpf.Server("late") as server:
            server.on(mpf.Int32)(lambda request: request.value + 1)
            server.start()
            values = [getattr(await request.wait(), "value") for request in await sending]

    assert values == [2, 3]


async def test_a_coroutine_receives_further_replies_to_many_requests(doubler: mpf.Server) -> None:
    doubler.on(mpf.Float64)(lambda request: (mpf.Int32(number) for number in (1, 2)))
    async with mpf.AsyncClient("doubler", timeout=PATIENCE) as client:
        requests = await client.send_many([mpf.Float64()] * 2, reply=mpf.Int32, further=1)
        replies = [(await request.wait(), await request.next(PATIENCE)) for request in requests]

        assert await requests[0].next(0) is None
    assert [[getattr(reply, "value") for reply in pair] for pair in replies] == [[1, 2]] * 2


async def test_cancelling_the_wait_for_one_of_many_requests_cancels_this_request(
    short: tuple[mpf.Server, mpf.Client],
) -> None:
    server, _ = short
    async with mpf.AsyncClient("short", timeout=PATIENCE) as client:
        await connect(client, server)
        first, second = await client.send_many([mpf.Int32(1), mpf.Int32(2)])
        waiting = asyncio.ensure_future(first.wait())
        await asyncio.sleep(0)

        waiting.cancel()

        with pytest.raises(asyncio.CancelledError):
            await waiting
        with pytest.raises(mpf.Cancelled):
            first.result()
        assert second.result() is None
        second.cancel()
        with pytest.raises(mpf.Cancelled):
            await second.wait()
