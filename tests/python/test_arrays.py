# SPDX-License-Identifier: MIT
"""Arrays: views of shared memory, loans, copies."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest
from conftest import PATIENCE

import mpf

LENGTH = 500_000  # above what fits a ring


@pytest.fixture
def echo() -> Iterator[mpf.Server]:
    server = mpf.Server("echo")
    server.on(mpf.Message)(lambda request: None)
    with server.start():
        yield server


@pytest.fixture
def client(echo: mpf.Server) -> Iterator[mpf.Client]:
    with mpf.Client("echo", timeout=PATIENCE) as client:
        yield client


@pytest.mark.parametrize("length", [0, 1, 2, 10, LENGTH])
@pytest.mark.parametrize("type", [mpf.Int32Array, mpf.Float64Array])
def test_arrays_return_as_they_were_sent(
    client: mpf.Client, type: type[mpf.Int32Array] | type[mpf.Float64Array], length: int
) -> None:
    sent = np.arange(length)

    reply = client.call(type(sent, cmd=3))

    assert np.array_equal(reply.value, sent)
    assert (len(reply), reply.cmd) == (length, 3)
    assert reply.value.dtype == (np.int32 if type is mpf.Int32Array else np.float64)


def test_a_received_array_is_read_only(client: mpf.Client) -> None:
    value = client.float64_array(np.zeros(LENGTH)).value

    assert not value.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        value[0] = 1
    with pytest.raises(ValueError):
        value.flags.writeable = True


def test_a_received_array_is_a_view(client: mpf.Client) -> None:
    reply = client.float64_array(np.arange(float(LENGTH)))

    assert reply.value.ctypes.data == reply.value.ctypes.data  # the same memory each time
    assert not reply.value.flags.owndata


def test_a_view_outlives_message_client_and_server(echo: mpf.Server) -> None:
    client = mpf.Client("echo", timeout=PATIENCE)
    value = client.float64_array(np.arange(float(LENGTH))).value
    client.close()
    echo.close()
    del client, echo
    gc.collect()

    assert value.sum() == LENGTH * (LENGTH - 1) / 2


def test_a_loaned_array_is_sent_without_a_copy(client: mpf.Client) -> None:
    assert client.wait_connected()
    loaned = client.loan(mpf.Int32Array, LENGTH)
    loaned.value[:] = np.arange(LENGTH)
    loaned.address = 4

    reply = client.call(loaned)

    assert reply.address == 4
    assert np.array_equal(reply.value, np.arange(LENGTH))
    with pytest.raises(ValueError, match="was sent"):
        loaned.value
    with pytest.raises(ValueError, match="was sent"):
        client.call(loaned)
    assert "sent" in repr(loaned)


def test_a_loaned_array_that_is_in_use_is_copied(client: mpf.Client) -> None:
    loaned = client.loan(mpf.Int32Array, 1000)
    value = loaned.value
    value[:] = 7

    first = client.call(loaned)
    value[:] = 8
    second = client.call(loaned)

    assert set(first.value) == {7}
    assert set(second.value) == {8}


def test_a_loaned_array_that_was_not_sent_keeps_its_elements(echo: mpf.Server) -> None:
    client = mpf.Client("echo", timeout=PATIENCE)
    loaned = client.loan(mpf.Int32Array, 10)
    loaned.value[:] = 5
    echo.close()

    with pytest.raises(mpf.NotSent):
        client.call(loaned, timeout=0.01)

    assert set(loaned.value) == {5}


def test_loans_are_arrays(client: mpf.Client) -> None:
    with pytest.raises(TypeError, match="Int32Array, Float64Array, Char8Array or User"):
        client.loan(mpf.Int32, 3)  # type: ignore[type-var]


def test_a_source_that_changes_later_does_not_change_the_message(client: mpf.Client) -> None:
    source = np.zeros(10, np.float64)
    message = mpf.Float64Array(source)
    request = client.send(message)
    source[:] = 1

    assert not request.wait().value.any()  # type: ignore[attr-defined]


def test_elements_are_converted(client: mpf.Client) -> None:
    assert client.int32_array([1, 2, 3]).value.tolist() == [1, 2, 3]
    assert client.float64_array(np.arange(10, dtype=np.int16)[::2]).value.tolist() == [
        0.0,
        2.0,
        4.0,
        6.0,
        8.0,
    ]
    assert mpf.Int32Array(np.arange(3.0)).value.tolist() == [0, 1, 2]
    for values in ([1.5], np.array([1 << 40]), [1 << 40], [1 << 70]):
        with pytest.raises(ValueError, match="32-bit"):
            mpf.Int32Array(values)
    with pytest.raises(ValueError, match="too large"):
        mpf.Float64Array([10**400])
    with pytest.raises(ValueError, match="one dimension"):
        mpf.Float64Array(np.zeros((2, 2)))


def test_elements_that_are_no_real_numbers_are_refused() -> None:
    date = np.datetime64("2026-11-30")
    for values in ([1j], [date], ["1"], [1, None], [Fraction(1), 1j], np.array(["1"], object)):
        for array in (mpf.Int32Array, mpf.Float64Array):
            with pytest.raises(TypeError, match=f"{array.__name__}: .* must be real numbers, not"):
                array(values)
    assert mpf.Float64Array([Fraction(1, 2), True, np.float32(2)]).value.tolist() == [0.5, 1.0, 2.0]
    assert mpf.Int32Array([]).value.tolist() == []


def test_text_and_bytes(client: mpf.Client) -> None:
    assert client.char8_array("µV").value == "µV".encode()
    assert client.char8_array("µV").text == "µV"
    assert client.char8_array(bytes(range(256))).value == bytes(range(256))
    assert client.char8_array(b"").value == b""
    reply = client.call(mpf.Char8Array("*IDN?", eom=b"\r\n"))
    assert reply.eom == b"\r\n"
    assert repr(reply) == "Char8Array(value=b'*IDN?', eom=b'\\r\\n')"


def test_user_messages_carry_any_buffer(client: mpf.Client) -> None:
    assert client.call(mpf.User(b"abc")).value.tobytes() == b"abc"
    assert client.call(mpf.User(np.arange(3.0))).value.cast("d").tolist() == [0.0, 1.0, 2.0]
    assert client.call(mpf.User(bytearray(LENGTH))).value.nbytes == LENGTH


def test_the_buffer_of_a_message_may_grow_and_shrink(client: mpf.Client) -> None:
    buffer = bytearray(10)
    message = mpf.User(buffer)
    for size in (LENGTH, 3, 0):
        buffer[:] = bytes(size)
        assert len(message) == size
        assert client.call(message).value.nbytes == size


def test_many_views_make_the_sender_run_out_of_memory_and_freeing_them_helps(
    client: mpf.Client,
) -> None:
    for _ in range(3):
        views = []
        for number in range(20):
            views.append(client.float64_array(np.full(LENGTH, float(number))).value)
        assert [view[-1] for view in views] == [float(number) for number in range(20)]
