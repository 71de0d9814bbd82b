# SPDX-License-Identifier: MIT
"""mpf.Client: calls, exceptions, Ctrl-C."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from conftest import PATIENCE, PROGRAMS, Silent, again_if_late, needs_mpf

import mpf


def test_a_call_returns_the_reply_of_a_server_in_another_process(
    start: Callable[..., subprocess.Popen[str]],
) -> None:
    start(PROGRAMS / "mpf-int32-server")

    with mpf.Client("Int32") as client:
        reply = client.call(mpf.Int32(value=3), timeout=PATIENCE)

    assert isinstance(reply, mpf.Int32)
    assert reply.status == 0


def test_a_call_by_type_sends_the_fields(doubler: mpf.Server) -> None:
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        reply = client.int32(21, cmd=2, address=3, extra=4)

    assert (reply.value, reply.cmd, reply.address, reply.extra) == (42, 2, 3, 4)


def test_a_message_can_be_sent_again(doubler: mpf.Server) -> None:
    message = mpf.Int32(value=5)
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        assert [client.call(message).value for _ in range(3)] == [10, 10, 10]


def test_requests_may_be_outstanding(doubler: mpf.Server) -> None:
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        requests = [client.send(mpf.Int32(value=number)) for number in range(50)]
        values = [getattr(request.wait(), "value") for request in requests]

    assert values == [2 * number for number in range(50)]


def test_an_absent_server_is_not_connected() -> None:
    with pytest.raises(mpf.NotConnected, match="nobody"):
        mpf.Client("nobody").int32(timeout=0.01)


def test_the_text_and_the_status_of_the_server_are_the_exception(doubler: mpf.Server) -> None:
    @doubler.on(mpf.Float64)
    def refuse(request: mpf.Float64) -> object:
        raise mpf.StatusError("no channel 7", status=-3)

    with mpf.Client("doubler", timeout=PATIENCE) as client:
        with pytest.raises(mpf.StatusError, match="doubler: status -3: no channel 7") as caught:
            client.float64(address=7)
        reply = client.call(mpf.Float64(address=7), check=False)

    copy = pickle.loads(pickle.dumps(caught.value))
    for error in (caught.value, copy):
        assert (error.status, error.text) == (-3, "no channel 7")
    assert (type(copy), str(copy), copy.reply) == (mpf.StatusError, str(caught.value), None)
    assert (reply.status, reply.text, reply.address) == (-3, "no channel 7", 7)


def test_a_reply_of_another_type_is_an_error_unless_it_is_expected(doubler: mpf.Server) -> None:
    @doubler.on(mpf.Float64)
    def other(request: mpf.Float64) -> mpf.Int32:
        return mpf.Int32(7)

    with mpf.Client("doubler", timeout=PATIENCE) as client:
        with pytest.raises(mpf.UnexpectedReply, match="reply=mpf.Int32") as caught:
            client.float64()
        expected = client.call(mpf.Float64(), reply=mpf.Int32)
        anything = client.call(mpf.Float64(), reply=mpf.Message)

    assert isinstance(caught.value.reply, mpf.Int32)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    assert expected.value == 7
    assert isinstance(anything, mpf.Int32)


def test_a_request_that_was_taken_and_has_no_reply_times_out(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client:
        assert client.wait_connected(PATIENCE)

        with pytest.raises(mpf.TimedOut, match="may have acted") as caught:
            again_if_late(
                lambda timeout: client.send(mpf.Int32(), timeout=timeout).wait(), 0.2, mpf.Expired
            )

    assert silent.came.acquire(timeout=PATIENCE)
    assert isinstance(caught.value, (mpf.OutcomeUnknown, TimeoutError))
    assert caught.value.fate == "outcomeUnknown"


def test_a_request_that_the_server_refuses_is_refused(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(), timeout=PATIENCE)
        assert silent.came.acquire(timeout=PATIENCE)
        silent.server.refuse(silent.requests[0])

        with pytest.raises(mpf.Refused):
            request.wait()


@pytest.fixture
def client() -> Iterator[mpf.Client]:
    with mpf.Client("Int32") as client:
        yield client


@pytest.fixture
def stopped(
    start: Callable[..., subprocess.Popen[str]], client: mpf.Client
) -> subprocess.Popen[str]:
    """The server of the client, which has replied to it and is stopped now."""
    process = start(PROGRAMS / "mpf-int32-server")
    client.int32(timeout=PATIENCE)
    process.send_signal(signal.SIGSTOP)
    os.waitpid(process.pid, os.WUNTRACED)
    return process


def test_a_request_whose_server_dies_has_an_unknown_outcome(
    stopped: subprocess.Popen[str], client: mpf.Client
) -> None:
    request = client.send(mpf.Int32(), timeout=PATIENCE)
    stopped.kill()

    with pytest.raises((mpf.NeverTaken, mpf.OutcomeUnknown)):
        request.wait()


@pytest.mark.usefixtures("stopped")
def test_a_request_that_no_server_takes_expires(client: mpf.Client) -> None:
    with pytest.raises(mpf.Expired, match="nothing was done"):
        client.int32(timeout=0.05)


def test_a_request_expires_while_another_thread_waits(
    stopped: subprocess.Popen[str], client: mpf.Client
) -> None:
    """The other thread may handle what belongs to this one."""
    other = client.send(mpf.Int32(), PATIENCE)
    waiting = threading.Thread(target=lambda: other.wait(check=False))
    waiting.start()

    for _ in range(20):
        with pytest.raises(mpf.Expired):
            client.int32(timeout=0.02)

    stopped.send_signal(signal.SIGCONT)
    waiting.join()


def test_a_reply_may_be_asked_for_again(doubler: mpf.Server) -> None:
    doubler.on(mpf.Float64Array)(lambda request: request.value * 2)
    with mpf.Client("doubler", timeout=PATIENCE) as client:
        request = client.send(mpf.Float64Array([1.0, 2.0]), PATIENCE)
        reply = request.wait()
        assert request.wait() is reply
        assert request.result() is reply


def test_a_cancelled_request_ends(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(), timeout=PATIENCE)
        request.cancel()

        with pytest.raises(mpf.Cancelled):
            request.wait()


def test_a_closed_request_has_ended(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client:
        request = client.send(mpf.Int32(), further=3)
        request.close()

        with pytest.raises(mpf.Cancelled):
            request.wait()
        assert request.next(PATIENCE) is None


@needs_mpf
def test_retry_sends_a_request_that_was_never_taken_to_the_next_server() -> None:
    first = mpf.Server("again")
    with mpf.Client("again", timeout=PATIENCE) as client:
        replies: list[int] = []

        def accept() -> None:  # connects the client, and takes no request
            while not client.connected:
                first._receive(0.01)

        accepting = threading.Thread(target=accept)
        accepting.start()
        assert client.wait_connected(PATIENCE)
        accepting.join()
        sender = threading.Thread(
            target=lambda: replies.append(client.call(mpf.Int32(4), PATIENCE, retry=True).value)
        )
        sender.start()
        while not mpf.stats("again")["links"][0]["unanswered"]:
            pass
        first.close()
        with mpf.Server("again") as second:
            second.on(mpf.Int32)(lambda request: request.value + 1)
            second.start()
            sender.join()

    assert replies == [5]


def test_a_full_queue_refuses_the_next_request(silent: Silent) -> None:
    with mpf.Client("silent", timeout=PATIENCE) as client, pytest.raises(mpf.QueueFull):
        requests = [client.send(mpf.Int32(), timeout=PATIENCE)]
        while True:
            requests.append(client.send(mpf.Int32(), timeout=PATIENCE))


def test_a_message_that_is_too_large_is_refused_with_the_limit() -> None:
    with mpf.Server("small", max_message_bytes=1000).start(), mpf.Client("small") as client:
        with pytest.raises(mpf.TooLarge, match="the limit is 1000"):
            client.float64_array(range(1000), timeout=PATIENCE)


def test_invalid_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="address: 4294967296"):
        mpf.Int32(address=2**32)
    with pytest.raises(ValueError, match="value: too large"):
        mpf.Float64(10**400)
    with pytest.raises(ValueError, match="eom: 5 bytes"):
        mpf.Char8Array(eom=b"12345")
    with pytest.raises(ValueError, match="parity: 'Even'"):
        mpf.SerialConfig(parity="Even")
    with pytest.raises(ValueError, match="wait: 'fast'"):
        mpf.Client("dac", wait="fast")
    with pytest.raises(ValueError, match="name"):
        mpf.Client("")
    with mpf.Client("dac", timeout=PATIENCE) as client, pytest.raises(TypeError, match="mpf.Int32"):
        client.call(3)  # type: ignore[type-var]


untyped: Any = mpf
WRONG = {
    "Int32: value must be an int, not float": lambda: untyped.Int32(1.5),
    "Int32: value must be an int, not float64": lambda: untyped.Int32(np.float64(2.0)),
    "Int32: value must be an int, not NoneType": lambda: untyped.Int32(None),
    "Int32: address must be an int, not str": lambda: untyped.Int32(address="3"),
    "Float64: value must be a float, not str": lambda: untyped.Float64("x"),
    "Char8Array: eom must be bytes, not str": lambda: untyped.Char8Array(eom="x"),
    "SerialConfig: parity must be a str, not int": lambda: untyped.SerialConfig(parity=1),
    "Float64Array: value must be an array, not int": lambda: untyped.Float64Array(3),
    "Int32Array: value must be an array, not int32": lambda: untyped.Int32Array(np.int32(3)),
    'Int32 has no field "adress"; use value, timeout, cmd, status, address, extra':
        lambda: untyped.Int32(1, adress=3),
    'User has no field "cmd"; use value': lambda: untyped.User(cmd=1),
    "Int32: status must be an int, not str": lambda: setattr(mpf.Int32(), "status", "x"),
    "Char8Array: eom must be bytes, not NoneType": lambda: setattr(mpf.Char8Array(), "eom", None),
}


@pytest.mark.parametrize("text", WRONG)
def test_a_value_of_the_wrong_type_is_named(text: str) -> None:
    with pytest.raises(TypeError, match=f"^{re.escape(text)}$"):
        WRONG[text]()


def test_integers_of_other_types_are_values() -> None:
    assert (mpf.Int32(np.int64(5)).value, mpf.Int32(True).value) == (5, 1)
    assert (mpf.Float64(3).value, mpf.Float64(np.float32(1.5)).value) == (3.0, 1.5)


def test_messages_compare_by_identity() -> None:
    """A server finds the requests that it keeps: two clients may send equal ones."""
    first, second = mpf.Int32(3), mpf.Int32(3)
    assert first != second
    assert len({first, second}) == 2


def test_a_closed_client_raises(doubler: mpf.Server) -> None:
    client = mpf.Client("doubler", timeout=PATIENCE)
    client.close()

    with pytest.raises(mpf.Error, match="the client is closed"):
        client.int32()


def test_ctrl_c_ends_a_subscription(doubler: mpf.Server) -> None:
    with mpf.Client("doubler") as client, client.subscribe(mpf.Int32()) as replies:
        next(replies)
        with pytest.raises(KeyboardInterrupt):
            threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)).start()
            next(replies)


def test_a_subscription_goes_on_after_ctrl_c(silent: Silent) -> None:
    def serve() -> None:
        assert silent.came.acquire(timeout=PATIENCE)
        os.kill(os.getpid(), signal.SIGINT)
        assert silent.came.acquire(timeout=PATIENCE)
        silent.server.reply(silent.requests[1], mpf.Int32(5))

    thread = threading.Thread(target=serve)
    thread.start()
    with mpf.Client("silent", timeout=PATIENCE) as client:
        replies = client.subscribe(mpf.Int32())
        with pytest.raises(KeyboardInterrupt):
            next(replies)
        assert next(replies).value == 5
    thread.join()


def test_ctrl_c_ends_a_server() -> None:
    server = mpf.Server("tested")
    server.on(mpf.Int32)(lambda request: 1)

    def interrupt() -> None:
        with mpf.Client("tested", timeout=PATIENCE) as client:
            client.int32()  # it runs
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    server.run()
    thread.join()
    server.close()


def test_ctrl_c_ends_a_call(silent: Silent) -> None:
    def interrupt() -> None:
        assert silent.came.acquire(timeout=PATIENCE)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with mpf.Client("silent", timeout=PATIENCE) as client, pytest.raises(KeyboardInterrupt):
        client.int32(timeout=PATIENCE)
    thread.join()


def test_ctrl_c_ends_the_wait_for_a_connection() -> None:
    with mpf.Client("nobody", timeout=PATIENCE) as client, pytest.raises(KeyboardInterrupt):
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)).start()
        client.int32(timeout=PATIENCE)


@pytest.mark.parametrize("kind", [mpf.Client, mpf.AsyncClient, mpf.Server])
def test_a_location_that_is_not_utf8_is_shown_escaped(
    kind: type[mpf.Client | mpf.AsyncClient | mpf.Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as variables:
        variables.setenv("MPF_LOCATION", os.fsdecode(b"\xff"))
        with pytest.raises(ValueError, match=r'MPF_LOCATION "\\xff": use an integer'):
            kind("tested")
