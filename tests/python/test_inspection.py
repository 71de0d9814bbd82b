# SPDX-License-Identifier: MIT
"""mpf.servers(), mpf.stats() and mpf.tap()."""

from __future__ import annotations

import threading
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
        seen: dict[str, dict[str, Any]] = {}
        for message in messages:  # a tap reads many requests, and then many replies
            if "message" in message:
                seen[message["direction"]] = message["message"]
            if len(seen) == 2:
                break
        done.set()
        thread.join()

    assert {direction: message["value"] for direction, message in seen.items()} == {
        "request": 21,
        "reply": 42,
    }


def test_a_tap_that_cannot_start_says_why() -> None:
    with pytest.raises(mpf.Error, match="location"):
        next(mpf.tap("doubler", location=2**40))
