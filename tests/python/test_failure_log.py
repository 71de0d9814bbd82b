# SPDX-License-Identifier: MIT
"""What a server logs about the requests that failed."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Iterator

import pytest
from conftest import PATIENCE

import mpf
from mpf.failure_log import AT_ONCE, EVERY, FailureLog, LogLimiter

FAILURES = 100


def ask(server: mpf.Server, count: int = 1) -> None:
    """Sends requests that fail; returns when the server has ended, so that all is logged."""
    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        for _ in range(count):
            with pytest.raises(mpf.StatusError):
                client.int32(5)


def test_a_limiter_admits_lines_as_the_programs_do() -> None:
    limiter = LogLimiter()

    assert [limiter.admit(0.0) for _ in range(50)] == [True] * AT_ONCE + [False] * 18
    assert not limiter.admit(EVERY - 0.1)
    assert limiter.admit(EVERY)
    assert not limiter.admit(EVERY)
    assert limiter.omitted == 20
    quiet = 1000 * EVERY
    assert [limiter.admit(quiet) for _ in range(50)].count(True) == AT_ONCE


def test_failures_cannot_fill_a_disk(
    server: mpf.Server, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("mpf.failure_log.monotonic", lambda: 0.0)

    @server.on(mpf.Int32)
    def fail(request: mpf.Int32) -> None:
        raise ValueError("no range")

    ask(server, FAILURES)

    failed = [record for record in caplog.records if "no range" in record.getMessage()]
    assert len(failed) == AT_ONCE
    assert f"tested: {FAILURES - AT_ONCE} more requests failed" in caplog.text


def test_a_line_has_the_number_of_those_before_it(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    now = 0.0
    monkeypatch.setattr("mpf.failure_log.monotonic", lambda: now)
    log = FailureLog("dac")
    for _ in range(AT_ONCE + 5):
        log.write(logging.ERROR, "%d failed", 7)

    now = EVERY
    log.write(logging.ERROR, "%d failed", 8)
    log.flush()

    assert len(caplog.records) == AT_ONCE + 1
    assert caplog.records[-1].getMessage() == "dac: 8 failed (the last of 6 failures)"


def test_a_traceback_begins_in_the_program(
    server: mpf.Server, caplog: pytest.LogCaptureFixture
) -> None:
    @server.on(mpf.Int32)
    def fail(request: mpf.Int32) -> None:
        raise ValueError("no range")

    ask(server)

    lines = caplog.text.splitlines()
    assert lines[0].endswith("tested: Int32(value=5) failed: ValueError: no range")
    assert lines[1].startswith("Traceback")
    assert "test_failure_log.py" in lines[2]
    assert "server.py" not in caplog.text


def wrong_value(request: mpf.Int32) -> str:
    return "x"


def wrong_values(request: mpf.Int32) -> Iterator[str]:
    yield "x"


async def wrong_async_values(request: mpf.Int32) -> AsyncIterator[str]:
    yield "x"


@pytest.mark.parametrize("handler", [wrong_value, wrong_values, wrong_async_values])
def test_a_wrong_value_is_one_line(
    server: mpf.Server, caplog: pytest.LogCaptureFixture, handler: object
) -> None:
    server.on(mpf.Int32)(handler)  # type: ignore[type-var]
    ask(server)
    (line,) = caplog.text.splitlines()
    assert "<class 'str'> is not the value of a reply to Int32 requests" in line


def test_a_type_without_a_handler_is_logged_for_debugging(
    server: mpf.Server, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG, "mpf"):
        ask(server)
    (record,) = caplog.records
    assert (record.levelno, record.exc_info) == (logging.DEBUG, None)
    assert "tested does not handle Int32 messages" in record.getMessage()
