# SPDX-License-Identifier: MIT
"""mpf.servers(), mpf.stats(), mpf.tap(), mpf.record() and mpf.replay()."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from conftest import PATIENCE, PROGRAMS

import mpf
from mpf import inspection, program


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


@pytest.mark.parametrize("name", ["-x", "--help"])
def test_a_name_may_look_like_an_option(
    name: str, backplane: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    other = f"-{backplane}"
    with mpf.Server(name, backplane=other) as server:
        server.on(mpf.Int32)(lambda request: request.value + 1)
        server.start()
        with mpf.Client(name, backplane=other, timeout=PATIENCE) as client:
            with mpf.record(name, name, other), mpf.tap(name, other) as messages:
                client.int32(2)
                assert isinstance(next(messages), dict)
        assert mpf.stats(name, other)["received"] == 1

    with mpf.replay(name, name, other, speed=0):
        with mpf.Client(name, backplane=other, timeout=PATIENCE) as client:
            assert client.int32(2).value == 3


def test_a_tap_that_cannot_start_says_why() -> None:
    with pytest.raises(mpf.Error, match="location"):
        next(mpf.tap("doubler", location=2**40))


def test_a_tap_ends_when_it_is_closed(doubler: mpf.Server) -> None:
    with mpf.Client("doubler") as client, mpf.tap("doubler") as messages:
        client.int32(timeout=PATIENCE)
        for _ in messages:
            messages.close()


@pytest.mark.parametrize(
    ("file", "reason"), [("nowhere/calls.mpf", "No such file"), ("/dev/full", "No space")]
)
def test_a_recording_that_cannot_be_written_is_an_error(
    tmp_path: Path, file: str, reason: str
) -> None:
    with pytest.raises(mpf.Error, match=reason):
        mpf.record("dac", tmp_path / file)


def test_the_package_is_the_program() -> None:
    shown = subprocess.check_output([sys.executable, "-m", "mpf", "call", "--help"])
    assert shown == subprocess.check_output([PROGRAMS / "mpf", "call", "--help"])


def test_a_program_that_writes_nothing_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = tmp_path / "mpf"
    silent.write_text("#!/bin/sh\nexec sleep infinity\n")
    silent.chmod(0o755)
    monkeypatch.setattr(program, "find", lambda: str(silent))
    monkeypatch.setattr(inspection, "_PATIENCE", 0.1)
    with pytest.raises(mpf.Error, match="has written nothing within 0.1 s"):
        mpf.record("doubler", str(tmp_path / "calls.mpf"))
    with pytest.raises(mpf.Error, match="has written nothing within 0.2 s"):
        mpf.replay(str(tmp_path / "calls.mpf"), timeout=0.2)


def test_a_recording_that_fails_is_an_error(doubler: mpf.Server, tmp_path: Path) -> None:
    recording = mpf.record("doubler", tmp_path / "calls.mpf")
    recording._process.kill()
    with pytest.raises(mpf.Error):
        recording.close()


def test_a_recording_answers_as_the_server_did(tmp_path: Path) -> None:
    file = tmp_path / "calls.mpf"
    with mpf.Server("dac") as server:

        @server.on(mpf.Int32)
        def answer(request: mpf.Int32) -> int:
            if request.cmd == 9:
                raise mpf.StatusError("no such channel", status=-9)
            return request.value + 1

        with server.start(), mpf.Client("dac") as client, mpf.record("dac", file) as recording:
            for value in range(5):
                client.int32(value, timeout=PATIENCE)
            with pytest.raises(mpf.StatusError):
                client.int32(cmd=9, timeout=PATIENCE)

    assert recording.missed == 0
    with mpf.replay(file, speed=0) as ghost, mpf.Client("dac") as client:
        assert [client.int32(value, timeout=PATIENCE).value for value in (3, 0, 4)] == [4, 1, 5]
        with pytest.raises(mpf.StatusError, match="no such channel"):
            client.int32(cmd=9, timeout=PATIENCE)
        with pytest.raises(mpf.Refused):
            client.float64(timeout=PATIENCE)

    assert ghost.counts == {"requests": 5, "similar": 0, "unknown": 1, "silent": 0, "replies": 4}


def test_a_ghost_that_has_died_is_an_error(doubler: mpf.Server, tmp_path: Path) -> None:
    with mpf.Client("doubler") as client, mpf.record("doubler", tmp_path / "calls.mpf"):
        client.int32(timeout=PATIENCE)
    ghost = mpf.replay(tmp_path / "calls.mpf", "ghost")
    ghost._process.kill()
    with pytest.raises(mpf.Error):
        ghost.close()


OF_A_PROGRAM = """
import signal, sys, mpf
if sys.argv[1] == "record":
    running = mpf.record("doubler", sys.argv[2])
else:
    running = mpf.replay(sys.argv[2], "ghost")
print(running._process.pid, flush=True)
signal.pause()
"""


@pytest.mark.parametrize("what", ["record", "replay"])
def test_what_a_program_started_ends_with_it(
    doubler: mpf.Server, tmp_path: Path, what: str
) -> None:
    file = tmp_path / "calls.mpf"
    with mpf.Client("doubler") as client, mpf.record("doubler", file):
        client.int32(timeout=PATIENCE)
    command = [sys.executable, "-B", "-c", OF_A_PROGRAM, what, str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as user:
        assert user.stdout is not None
        started = os.pidfd_open(int(user.stdout.readline()))
        user.kill()

    assert select.select([started], [], [], PATIENCE)[0]
    os.close(started)


def test_a_file_that_is_no_recording_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("a text that is not a recording\n" * 10)
    with pytest.raises(mpf.Error, match="not a recording"):
        mpf.replay(tmp_path / "text")
