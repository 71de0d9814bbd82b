# SPDX-License-Identifier: MIT
"""mpf.Client.send_many(): order, full queues, what stays when a message is not sent."""

from __future__ import annotations

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
    with mpf.Server("short", queue_size=5) as server, mpf.Client("short") as client:
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
