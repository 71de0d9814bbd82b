# SPDX-License-Identifier: MIT
"""mpf.Server: functions, coroutines, generators, errors."""

from __future__ import annotations

import asyncio
import grp
import os
import stat
import subprocess
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest
from conftest import PATIENCE, PROGRAMS, needs_mpf

import mpf


def call(message: mpf.Message) -> object:
    with mpf.Client("tested", timeout=PATIENCE) as client:
        return client.call(message, PATIENCE, reply=mpf.Message)


def test_a_handler_may_change_the_request(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    def change(request: mpf.Int32) -> None:
        request.value += 1
        request.status = 0

    with server.start():
        assert call(mpf.Int32(1)).value == 2  # type: ignore[attr-defined]


def test_a_handler_may_return_an_array(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    def scan(request: mpf.Int32) -> mpf.Float64Array:
        return mpf.Float64Array(np.arange(float(request.value)), address=request.address)

    with server.start():
        reply = call(mpf.Int32(100_000, address=2))

    assert isinstance(reply, mpf.Float64Array)
    assert (len(reply), reply.address, reply.value[-1]) == (100_000, 2, 99_999.0)


def test_a_handler_may_fill_a_loaned_array(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    def scan(request: mpf.Int32) -> mpf.Float64Array:
        reply = server.loan(request, mpf.Float64Array, request.value)
        reply.value[:] = 3
        return reply

    with server.start():
        assert call(mpf.Int32(100_000)).value.sum() == 300_000  # type: ignore[attr-defined]


def test_a_handler_may_reply_later_and_often(server: mpf.Server) -> None:
    kept: list[mpf.Float64] = []

    @server.on(mpf.Float64)
    async def keep(request: mpf.Float64) -> mpf.Int32:
        kept.append(request)
        return mpf.Int32(0)

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        request = client.send(mpf.Float64(), reply=mpf.Message, further=10)
        request.wait()
        assert server.is_client_connected(kept[0])
        for number in (1, 2, 3):
            assert server.reply(kept[0], mpf.OutOfBand(number))
        further = [request.next(PATIENCE) for _ in range(3)]
        client.close()
        while server.is_client_connected(kept[0]):
            pass

    assert [getattr(message, "value") for message in further] == [1, 2, 3]
    kept.clear()


def test_a_further_reply_may_be_a_value(server: mpf.Server) -> None:
    kept: list[mpf.Float64] = []
    server.on(mpf.Float64)(kept.append)

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        with client.subscribe(mpf.Float64(address=3)) as replies:
            next(replies)
            assert server.reply(kept[0], 2.5)
            with pytest.raises(TypeError, match="'str'> .* Float64 requests: reply with a message"):
                server.reply(kept[0], "x")
            kept[0].value = 3.5
            assert server.reply(kept.pop())
            further = [next(replies) for _ in range(2)]

    assert [(reply.value, reply.address) for reply in further] == [(2.5, 3), (3.5, 3)]


def test_coroutines_run_at_the_same_time(server: mpf.Server) -> None:
    both = 0
    met: asyncio.Event | None = None

    @server.on(mpf.Int32)
    async def meet(request: mpf.Int32) -> int:
        nonlocal both, met
        met = met or asyncio.Event()
        both += 1
        if both == 2:
            met.set()
        await asyncio.wait_for(met.wait(), PATIENCE)
        return request.value

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        requests = [client.send(mpf.Int32(number)) for number in (1, 2)]

        assert [getattr(request.wait(), "value") for request in requests] == [1, 2]


def test_an_async_generator_sends_many_replies(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    async def count(request: mpf.Int32) -> AsyncIterator[int]:
        for number in range(request.value):
            await asyncio.sleep(0)
            yield number

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        with client.subscribe(mpf.Int32(3)) as replies:
            assert [next(replies).value for _ in range(3)] == [0, 1, 2]


@pytest.mark.parametrize("isCoroutine", [False, True])
def test_an_exception_becomes_a_status_and_a_text(server: mpf.Server, isCoroutine: bool) -> None:
    if isCoroutine:

        @server.on(mpf.Int32)
        async def fail(request: mpf.Int32) -> None:
            raise ZeroDivisionError("no range")
    else:

        @server.on(mpf.Int32)
        def fail(request: mpf.Int32) -> None:
            raise ZeroDivisionError("no range")

    with server.start():
        for _ in range(2):  # the server goes on
            with pytest.raises(mpf.StatusError, match="ZeroDivisionError: no range") as caught:
                call(mpf.Int32(address=4))

    assert caught.value.status == -1
    assert getattr(caught.value.reply, "address") == 4


def test_a_type_without_a_handler_is_an_error(server: mpf.Server) -> None:
    server.on(mpf.Float64)(lambda request: 1.0)
    with server.start(), pytest.raises(mpf.StatusError, match="does not handle Int32"):
        call(mpf.Int32())


@needs_mpf
def test_a_program_of_c_plus_plus_sees_status_and_text(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    def fail(request: mpf.Int32) -> None:
        raise mpf.StatusError("the shutter is closed", status=5)

    with server.start():
        done = subprocess.run(
            [PROGRAMS / "mpf", "call", "tested", "int32", "value=3", "--timeout", str(PATIENCE)],
            capture_output=True,
            text=True,
        )

    assert "the shutter is closed" in done.stdout
    assert "status=5" in done.stdout


def test_a_name_in_use_is_an_error(server: mpf.Server) -> None:
    with pytest.raises(mpf.NameInUse, match="tested"):
        mpf.Server("tested")


def test_run_ends_with_interrupt(server: mpf.Server) -> None:
    thread = threading.Thread(target=server.run)
    thread.start()
    server.interrupt()
    thread.join()


def test_serve_runs_in_an_event_loop_beside_a_client(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: request.value + 1)

    async def both() -> int:
        serving = asyncio.ensure_future(server.serve())
        async with mpf.AsyncClient("tested", timeout=PATIENCE) as client:
            reply = await client.call(mpf.Int32(1))
        server.interrupt()
        await serving
        return reply.value

    assert asyncio.run(both()) == 2


def test_a_closed_server_raises(server: mpf.Server) -> None:
    server.close()

    with pytest.raises(mpf.Error, match="the server is closed"):
        server.run()


def test_a_server_runs_once_at_a_time(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: 1)
    server.start()
    call(mpf.Int32())  # it runs

    with pytest.raises(RuntimeError, match="start"):
        server.start()
    with pytest.raises(RuntimeError, match="runs already"):
        server.run()


def test_only_messages_have_handlers(server: mpf.Server) -> None:
    with pytest.raises(TypeError, match="int"):
        server.on(int)  # type: ignore[type-var]
    with pytest.raises(TypeError, match="5 is not a function"):
        server.on(mpf.Int32)(5)  # type: ignore[type-var]


def test_a_handler_replaces_the_earlier_one(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: 1)
    with server.start():
        assert getattr(call(mpf.Int32()), "value") == 1
        server.on(mpf.Int32)(lambda request: 2)
        assert getattr(call(mpf.Int32()), "value") == 2


def test_a_generator_without_values_refuses_the_request(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: (number for number in ()))
    with server.start(), pytest.raises(mpf.Refused, match="no handler .* or dropped the request"):
        call(mpf.Int32())


class Mute(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no text")


ERRORS = [
    Exception("\ud800"),
    Mute(),
    mpf.StatusError("", status=1 << 40),
    mpf.StatusError("", status=0),
    mpf.StatusError("", status="7"),  # type: ignore[arg-type]
    mpf.StatusError(OSError(5, "dead")),  # type: ignore[arg-type]
]


@pytest.mark.parametrize("error", ERRORS)
def test_any_exception_reaches_the_client(server: mpf.Server, error: Exception) -> None:
    @server.on(mpf.Int32)
    def fail(request: mpf.Int32) -> None:
        raise error

    with server.start(), pytest.raises(mpf.StatusError) as caught:
        call(mpf.Int32())
    assert caught.value.status == -1


def test_a_value_of_another_type_is_an_error_that_says_so(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: np.zeros(3))
    with server.start(), pytest.raises(mpf.StatusError, match="ndarray.*Int32"):
        call(mpf.Int32())


def test_only_requests_have_replies(server: mpf.Server) -> None:
    for act in (
        lambda: server.reply(mpf.Int32(), mpf.Int32()),
        lambda: server.refuse(mpf.Float64Array([1.0])),
        lambda: server.loan(mpf.Int32(), mpf.Int32Array, 3),
        lambda: server.is_client_connected(mpf.Int32()),
    ):
        with pytest.raises(ValueError, match="not a request"):
            act()


def sent_and_received(
    server: mpf.Server, client: mpf.Client, value: float = 1.0
) -> tuple[mpf.Request, mpf.Message]:
    """A request with 100,000 elements of this value."""
    sent: list[mpf.Request] = []
    message = mpf.Float64Array(np.full(100_000, value))
    sending = threading.Thread(target=lambda: sent.append(client.send(message, PATIENCE)))
    sending.start()
    received = server._receive(PATIENCE)
    assert received is not None
    sending.join()
    return sent[0], received


def test_a_refused_request_keeps_its_elements(server: mpf.Server) -> None:
    with mpf.Client("tested", timeout=PATIENCE) as client:
        sent, request = sent_and_received(server, client)
        view = getattr(request, "value")
        server.refuse(request)
        for _ in range(20):  # would overwrite memory that was given back
            other, another = sent_and_received(server, client, 2.0)
            server.refuse(another)
            with pytest.raises(mpf.Refused):
                other.wait()

        assert view.sum() == getattr(request, "value").sum() == 100_000
        with pytest.raises(mpf.Refused):
            sent.wait()


def test_a_loaned_reply_goes_to_the_request_that_it_is_sent_to(server: mpf.Server) -> None:
    with mpf.Client("tested", timeout=PATIENCE) as first, mpf.Client("tested") as second:
        one, to_first = sent_and_received(server, first)
        two, to_second = sent_and_received(server, second)
        loaned = server.loan(to_first, mpf.Float64Array, 100_000)
        loaned.value[:] = 3.0

        assert server.reply(to_second, loaned)

        assert getattr(two.wait(), "value").sum() == 300_000
        assert one.result() is None


def test_replies_have_time_stamps(server: mpf.Server) -> None:
    @server.on(mpf.Int32)
    def stamp(request: mpf.Int32) -> mpf.Int32:
        reply = mpf.Int32(1)
        reply.time_stamp_ns = request.value
        return reply

    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        assert client.int32(5).time_stamp_ns == 5
        before = time.time_ns()
        assert before <= client.int32(0).time_stamp_ns <= time.time_ns()


def test_a_name_in_use_by_this_process_says_what_frees_it(server: mpf.Server) -> None:
    with pytest.raises(mpf.NameInUse, match=r"tested: this process .* close\(\) frees the name"):
        mpf.Server("tested")
    server.close()
    mpf.Server("tested").close()


def test_mode_and_group_admit_users(backplane: str) -> None:
    number = max(os.getgroups() or [os.getgid()])

    def rights() -> set[tuple[int, int]]:
        """Of the segments in shared memory that a client opens for writing."""
        found = [file.stat() for file in Path("/dev/shm").glob(f"mpf.{backplane}.h.*")]
        return {(stat.S_IMODE(one.st_mode), one.st_gid) for one in found}

    with mpf.Server("open", mode=0o660, group=grp.getgrgid(number).gr_name):
        assert rights() == {(0o660, number)}
    with mpf.Server("closed"):
        assert rights() == {(0o600, os.getgid())}


def test_invalid_arguments_of_a_server_are_named() -> None:
    with pytest.raises(ValueError, match="mode: 0o1224 .* 0o660"):
        mpf.Server("tested", mode=660)
    with pytest.raises(ValueError, match="mode: 0o60 "):
        mpf.Server("tested", mode=0o060)
    with pytest.raises(ValueError, match="group: .*'no such group'"):
        mpf.Server("tested", group="no such group")
    with pytest.raises(ValueError, match="max borrowed 1000: use 1 to 64"):
        mpf.Server("tested", max_borrowed=1000)


def test_a_loan_that_is_too_large_is_refused(server: mpf.Server) -> None:
    server.on(mpf.Int32)(lambda request: server.loan(request, mpf.Float64Array, 10**9))
    with server.start(), mpf.Client("tested", timeout=PATIENCE) as client:
        with pytest.raises(mpf.StatusError, match="TooLarge: .*8000000024 bytes, the limit is"):
            client.call(mpf.Int32(), reply=mpf.Message)
        with pytest.raises(mpf.TooLarge, match="no loan: .* the limit is 67108864"):
            client.loan(mpf.Float64Array, 10**9)
        with pytest.raises(mpf.TooLarge):
            server.loan_shared(mpf.Float64Array, 10**9)
