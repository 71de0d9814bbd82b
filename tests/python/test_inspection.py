# SPDX-License-Identifier: MIT
"""mpf.servers(), mpf.stats() and mpf.tap()."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from conftest import PATIENCE

import mpf


def test_servers_and_their_counters(doubler: mpf.Server) -> None:
    with mpf.Client("doubler") as client:
        client.int32(timeout=PATIENCE)
        [server] = mpf.servers()
        stats = mpf.stats("doubler")

    assert (server["name"], server["state"]) == ("doubler", "alive")
    assert stats["received"] == 1
    assert mpf.servers(location=5) == []


def test_an_absent_server_has_no_counters() -> None:
    with pytest.raises(LookupError, match="nobody"):
        mpf.stats("nobody")


def test_a_tap_shows_each_message(doubler: mpf.Server) -> None:
    done = threading.Event()
    with mpf.Client("doubler") as client, mpf.tap("doubler") as messages:

        def ask() -> None:
            while not done.is_set():
                client.int32(21, address=3, timeout=PATIENCE)

        thread = threading.Thread(target=ask)
        thread.start()
        seen = {one["direction"]: one["message"] for one in messages_of(messages, 10)}
        done.set()
        thread.join()

    assert {direction: message["value"] for direction, message in seen.items()} == {
        "request": 21,
        "reply": 42,
    }


def messages_of(tap: mpf.Tap, count: int) -> Iterator[dict[str, Any]]:
    return itertools.islice((one for one in tap if "message" in one), count)


def test_a_tap_that_cannot_start_says_why() -> None:
    with pytest.raises(mpf.Error, match="location"):
        next(mpf.tap("doubler", location=2**40))
