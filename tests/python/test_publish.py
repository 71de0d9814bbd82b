# SPDX-License-Identifier: MIT
"""mpf.Server.publish(): one array for many clients."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import PATIENCE

import mpf

LENGTH = 100_000


@pytest.fixture
def server() -> Iterator[mpf.Server]:
    """A server that does not run: it receives when a test calls subscribe()."""
    with mpf.Server("camera", max_borrowed=2, max_message_bytes=1 << 20) as server:
        yield server


def subscribe(
    server: mpf.Server, stack: contextlib.ExitStack, further: int = 10
) -> tuple[mpf.Request, mpf.Message]:
    """A request of a new client, as the client has sent it and as the server has received it."""
    client = stack.enter_context(mpf.Client("camera"))
    while not client.wait_connected(0.01):
        server._receive(0)
    sent = client.send(mpf.Int32(), PATIENCE, reply=mpf.Float64Array, further=further)
    received = server._receive(PATIENCE)
    assert received is not None
    return sent, received


def total(message: mpf.Message | None) -> float:
    return getattr(message, "value").sum()


def test_an_array_reaches_all_clients_and_may_be_the_first_reply(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        pairs = [subscribe(server, stack) for _ in range(3)]
        requests = [received for _, received in pairs]

        for value in (1.0, 2.0):
            gone = server.publish(mpf.Float64Array(np.full(LENGTH, value), extra=7), requests)
            assert gone == []

        for sent, _ in pairs:
            first = sent.wait()
            assert (total(first), getattr(first, "extra")) == (LENGTH, 7)
            assert first.time_stamp_ns > 0
            assert total(sent.next(PATIENCE)) == 2 * LENGTH


def test_a_loaned_array_is_published_without_a_copy(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        sent, received = subscribe(server, stack)
        loaned = server.loan_shared(mpf.Float64Array, LENGTH)
        loaned.value[:] = 3.0

        server.publish(loaned, [received])

        with pytest.raises(ValueError, match="sent"):
            loaned.value
        assert total(sent.wait()) == 3 * LENGTH


def test_what_the_program_can_still_write_to_is_copied(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        sent, received = subscribe(server, stack)
        loaned = server.loan_shared(mpf.Float64Array, LENGTH)
        view = loaned.value
        view[:] = 1.0

        server.publish(loaned, [received])
        reply = sent.wait()
        view[:] = 2.0
        server.publish(loaned, (request for request in [received]))

        assert (total(reply), total(sent.next(PATIENCE))) == (LENGTH, 2 * LENGTH)


def test_messages_of_other_classes_are_published_too(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        sent, received = subscribe(server, stack)

        server.publish(mpf.Int32(5, address=3), [received])

        reply = sent.wait(check=False)
        assert (getattr(reply, "value"), getattr(reply, "address")) == (5, 3)


def test_a_slow_client_misses_messages_and_counts_them(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        slow, for_slow = subscribe(server, stack)
        fast, for_fast = subscribe(server, stack)

        def publish(value: float) -> None:
            message = mpf.Float64Array(np.full(LENGTH, value))
            assert server.publish(message, [for_slow, for_fast]) == []

        publish(0.0)
        # The first reply stays with its request: it is one of the two that a client may hold.
        assert total(slow.wait()) == total(fast.wait()) == 0.0
        for value in (1.0, 2.0, 3.0):
            publish(value)
            assert total(fast.next(PATIENCE)) == value * LENGTH
        assert total(slow.next(PATIENCE)) == LENGTH  # and frees it
        publish(4.0)

        assert total(slow.next(PATIENCE)) == total(fast.next(PATIENCE)) == 4.0 * LENGTH
        assert (slow.missed, fast.missed) == (2, 0)


def test_requests_of_clients_that_have_gone_are_returned(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        sent, received = subscribe(server, stack)
        with contextlib.ExitStack() as short:
            other = subscribe(server, short)[1]
        while not server.publish(mpf.Float64Array(), [other]):
            server._receive(0)  # notices that the client has gone

        assert server.publish(mpf.Float64Array([1.0]), [other, received]) == [other]

        assert total(sent.wait()) == 1.0


def test_an_array_that_is_too_large_is_not_lost(server: mpf.Server) -> None:
    with contextlib.ExitStack() as stack:
        sent, received = subscribe(server, stack)
        larger = stack.enter_context(mpf.Server("larger"))
        loaned = larger.loan_shared(mpf.Float64Array, 1 << 18)
        loaned.value[:] = 1.0

        with pytest.raises(mpf.TooLarge, match="camera"):
            server.publish(loaned, [received])

        assert loaned.value.sum() == 1 << 18
        assert sent.result() is None


def test_only_requests_are_published_to(server: mpf.Server) -> None:
    with pytest.raises(ValueError, match="not a request"):
        server.publish(mpf.Int32(), [mpf.Int32()])
    with pytest.raises(TypeError, match="not a request"):
        server.publish(mpf.Int32(), [3])  # type: ignore[type-var]
    with pytest.raises(ValueError, match="1 to 64"):
        mpf.Server("other", max_borrowed=65)
