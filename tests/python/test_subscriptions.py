# SPDX-License-Identifier: MIT
"""mpf.Client.subscribe()."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
from conftest import PATIENCE, Silent, again_if_late

import mpf


def test_a_subscription_iterates_over_all_replies(doubler: mpf.Server) -> None:
    @doubler.on(mpf.Float64)
    def count(request: mpf.Float64) -> Iterator[float]:
        yield from map(float, range(int(request.value)))

    with mpf.Client("doubler") as client, client.subscribe(mpf.Float64(5.0)) as replies:
        values = [next(replies).value for _ in range(5)]

    assert values == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert replies.missed == 0


def test_a_subscription_may_have_replies_of_another_class(doubler: mpf.Server) -> None:
    @doubler.on(mpf.Char8Array)
    def count(request: mpf.Char8Array) -> Iterator[mpf.Float64]:
        yield from (mpf.Float64(number) for number in range(2))

    with mpf.Client("doubler", timeout=PATIENCE) as client:
        with client.subscribe(mpf.Char8Array("count"), reply=mpf.Float64) as replies:
            assert [next(replies).value for _ in range(2)] == [0.0, 1.0]
        with pytest.raises(mpf.UnexpectedReply):
            next(client.subscribe(mpf.Char8Array("count")))


def test_a_subscription_counts_what_the_program_did_not_take(doubler: mpf.Server) -> None:
    @doubler.on(mpf.Float64)
    def count(request: mpf.Float64) -> Iterator[float]:
        yield from map(float, range(10))

    with mpf.Client("doubler", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Float64(), limit=3)
        first = next(replies).value
        client.int32()  # behind the further replies
        while replies.missed < 6:
            client.int32()
        rest = [next(replies).value for _ in range(3)]

    assert (first, rest) == (0.0, [7.0, 8.0, 9.0])


def test_a_subscription_is_renewed_when_the_server_starts_again() -> None:
    def serve() -> mpf.Server:
        server = mpf.Server("source")
        server.on(mpf.Int32)(lambda request: (number for number in (1, 2)))
        return server.start()

    first = serve()
    with mpf.Client("source", timeout=PATIENCE) as client, client.subscribe(mpf.Int32()) as replies:
        before = [next(replies).value, next(replies).value]
        first.close()
        with serve():
            after = [next(replies).value, next(replies).value]

    assert before == after == [1, 2]


@pytest.mark.parametrize("hasReply", [False, True])
def test_another_thread_may_close_a_subscription(silent: Silent, hasReply: bool) -> None:
    received: list[int] = []
    with mpf.Client("silent", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Int32())

        def receive() -> None:
            for reply in replies:
                received.append(reply.value)

        receiving = threading.Thread(target=receive)
        receiving.start()
        assert silent.came.acquire(timeout=PATIENCE)
        if hasReply:
            silent.server.reply(silent.requests[0], mpf.Int32(5))
            while not received:
                time.sleep(0)
        replies.close()
        receiving.join()

    assert received == ([5] if hasReply else [])


def test_a_subscription_that_waits_for_its_server_may_be_closed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waits = threading.Event()

    def wait(client: mpf.Client, timeout: float) -> bool:
        waits.set()
        return client._wait_connected(timeout)

    monkeypatch.setattr(mpf.Client, "wait_connected", wait)
    with mpf.Client("absent") as client:
        replies = client.subscribe(mpf.Int32())
        received: list[list[mpf.Int32]] = []
        receiving = threading.Thread(target=lambda: received.append(list(replies)))
        receiving.start()
        assert waits.wait(PATIENCE)
        replies.close()
        receiving.join()

    assert received == [[]]


def test_further_replies_of_a_request_that_was_sent_again_arrive() -> None:
    def serve() -> mpf.Server:
        server = mpf.Server("source")
        server.on(mpf.Int32)(lambda request: (number for number in range(3)))
        return server

    first = serve()  # does not run
    with mpf.Client("source", timeout=PATIENCE) as client:
        connecting = threading.Thread(target=first.run)
        connecting.start()
        assert client.wait_connected(PATIENCE)
        first.interrupt()
        connecting.join()
        request = client.send(mpf.Int32(), PATIENCE, retry=True, further=10)
        first.close()
        with serve().start():
            values = [request.wait().value]
            while len(values) < 3:
                values.append(request.next(PATIENCE).value)

    assert values == [0, 1, 2]


def test_a_subscription_without_renewal_ends_with_the_server() -> None:
    server = mpf.Server("source")
    server.on(mpf.Int32)(lambda request: 1)
    server.start()
    with mpf.Client("source", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Int32(), renew=False)
        next(replies)
        server.close()

        assert list(replies) == []


def test_a_subscription_times_out(doubler: mpf.Server) -> None:
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        assert client.wait_connected(PATIENCE)

        def subscribe(timeout: float) -> Iterator[mpf.Int32]:
            replies = client.subscribe(mpf.Int32(), timeout=timeout)
            next(replies)
            return replies

        replies = again_if_late(subscribe, 0.05, TimeoutError)

        with pytest.raises(TimeoutError):
            next(replies)


def test_a_subscription_whose_first_reply_is_late_times_out(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client, pytest.raises(TimeoutError):
        assert client.wait_connected(PATIENCE)
        next(client.subscribe(mpf.Int32(), timeout=0.5))


def test_a_subscription_that_the_server_refuses_ends(silent: Silent) -> None:
    def refuse() -> None:
        assert silent.came.acquire(timeout=PATIENCE)
        silent.server.refuse(silent.requests[0])

    thread = threading.Thread(target=refuse)
    thread.start()
    with mpf.Client("silent", timeout=PATIENCE) as client, pytest.raises(mpf.Refused):
        next(client.subscribe(mpf.Int32()))
    thread.join()
    assert len(silent.requests) == 1
