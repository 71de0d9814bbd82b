# SPDX-License-Identifier: MIT
"""Serial and Gpib: instruments behind mpf-serial-server and mpf-gpib-server.

    with mpf.Serial("voltmeter") as meter:
        print(meter.query("VOLT?\\r"))

    with mpf.Gpib("GPIB0", 22) as meter:
        print(meter.query("ID?\\n"), meter.poll())

The servers let each operation finish before the next one, of any client, begins: what query()
writes and reads belongs together. The commands are those of <mpf/serial_commands.h> and
<mpf/gpib_commands.h>.
"""

from __future__ import annotations

import math
import time
from typing import Any

from mpf._mpf import Char8Array, Int32, Message, SerialConfig
from mpf.client import Client
from mpf.closing import Closing
from mpf.errors import InstrumentError, InstrumentTimeout
from mpf.seconds import checked_seconds

_READ, _WRITE, _WRITE_READ, _POLL, _CLEAR, _TRIGGER = 1, 2, 3, 4, 5, 6
_FLUSH, _SET_EOM, _MILLISECONDS = 0x10, 0x80, 0x100
_LEASE, _UNLEASE = 12, 13
_TIMEOUT = 1  # the status of both servers
QUEUE_TIMEOUT = 5.0  # [s]
_LONGEST = 2_147_483.0  # [s] what a request can say

_SERIAL_STATUS = {
    1: "no complete answer in time",
    2: "the answer is longer than the buffer",
    3: "the line failed",
}
_GPIB_STATUS = {
    1: "no complete answer in time, or the bus was busy",
    2: "the answer is longer than the buffer of the server",
    3: "the controller or the bus failed",
    4: "no instrument accepts bytes at this address",
    5: "this controller cannot do it",
    6: "another client has the bus to itself",
    7: "the request is invalid",
}


def _milliseconds(seconds: float) -> int:
    return max(1, math.ceil(min(max(seconds, 0.0), _LONGEST) * 1000))


class Instrument(Closing):
    """What Serial and Gpib have in common.

    timeout: [s] of operations without their own: how long the instrument may take, from the moment
        at which the server begins the operation.
    queue_timeout: [s] how much longer an operation may last: for the connection to the server, and
        for operations of other clients that come before. Without a connection in this time it
        raises NotConnected; if the server has not begun it when both times have passed, Expired.

    No operation lasts longer than `timeout` and `queue_timeout` together. Any thread may use an
    instrument. Operations raise InstrumentTimeout or InstrumentError, whose `answer` has the bytes
    that were read, or an exception of Client.call().
    """

    def __init__(
        self,
        server: str,
        address: int = 0,
        location: int | None = None,
        *,
        backplane: str = "",
        timeout: float = 1.0,
        queue_timeout: float = QUEUE_TIMEOUT,
        status_texts: dict[int, str],
    ) -> None:
        self.client = Client(server, location, backplane=backplane)
        #: The address on the bus; 0 on a serial line.
        self.address = address
        #: [s] how long the instrument may take
        self.timeout = timeout
        #: [s] how much longer an operation may last
        self.queue_timeout = queue_timeout
        self._status_texts = status_texts

    def close(self) -> None:
        """Disconnects from the server."""
        self.client.close()

    def write(self, data: str | bytes, timeout: float | None = None) -> None:
        """Writes all bytes.

        timeout: [s] how long the instrument may take to accept them; by default that of the object.
        """
        self._ask(_WRITE, data, timeout=timeout)

    def read(self, size: int = 0, timeout: float | None = None, *, eom: bytes = b"") -> bytes:
        """Reads until the end of message, or until `size` bytes have come.

        size: [bytes] the longest answer; 0: the size of the server's buffer, which an option of the
            server sets.
        timeout: [s] how long the instrument may take until the answer is complete; by default that
            of the object. Then InstrumentTimeout, whose `answer` has the bytes that have come.
        eom: bytes that end the answer, besides what always does.
        """
        return self._ask(_READ, b"", size, timeout, eom).value

    def query(
        self,
        data: str | bytes,
        size: int = 0,
        timeout: float | None = None,
        *,
        eom: bytes = b"",
    ) -> bytes:
        """Writes, then reads; no operation of another client comes between.

        The arguments are those of read(); `timeout` is for both together.
        """
        return self._ask(_WRITE_READ, data, size, timeout, eom).value

    def _eom_options(self, eom: bytes) -> int:
        return 0

    def _ask(
        self,
        cmd: int,
        data: str | bytes = b"",
        extra: int = 0,
        timeout: float | None = None,
        eom: bytes = b"",
    ) -> Char8Array:
        limit = checked_seconds(self.timeout if timeout is None else timeout)
        request = Char8Array(
            data,
            cmd=cmd | _MILLISECONDS | self._eom_options(eom),
            address=self.address,
            extra=extra,
            timeout=_milliseconds(limit),
            eom=eom,
        )
        reply = self._call(request, limit, reply=Char8Array, check=False)
        assert isinstance(reply, Char8Array)
        if reply.status != 0:
            kind = InstrumentTimeout if reply.status == _TIMEOUT else InstrumentError
            reason = self._status_texts.get(reply.status, f"status {reply.status}")
            raise kind(f"{self.client.server}: {reason}", reply)
        return reply

    def _call(self, request: Message, limit: float, **options: Any) -> Message:
        end = time.monotonic() + max(limit, 0.0) + self.queue_timeout
        # Without a connection, call() raises the reason at once.
        isConnected = self.client.wait_connected(self.queue_timeout)
        timeout = end - time.monotonic() if isConnected else 0.0
        reply: Message = self.client.call(request, timeout, **options)
        return reply


class Serial(Instrument):
    """An instrument on the line of a serial server. The server knows the end of its messages;
    `eom`, at most 2 bytes, changes it for all clients."""

    def __init__(
        self,
        server: str,
        location: int | None = None,
        *,
        backplane: str = "",
        timeout: float = 1.0,
        queue_timeout: float = QUEUE_TIMEOUT,
    ) -> None:
        super().__init__(
            server,
            location=location,
            backplane=backplane,
            timeout=timeout,
            queue_timeout=queue_timeout,
            status_texts=_SERIAL_STATUS,
        )

    def flush(self) -> None:
        """Drops bytes that have arrived."""
        try:
            self._ask(_READ | _FLUSH, b"", 0, 0.001)
        except InstrumentTimeout:
            pass

    def configure(
        self,
        *,
        baud: int = 0,
        stop_bits: int = 0,
        bits_per_char: int = 0,
        parity: str = "",
        flow_control: str = "",
    ) -> None:
        """Changes settings of the line, for all clients; 0 and "" keep the present one.

        parity: "E", "O" or "N". flow_control: "H" (hardware) or "N".
        """
        config = SerialConfig(
            baud=baud,
            stop_bits=stop_bits,
            bits_per_char=bits_per_char,
            parity=parity,
            flow_control=flow_control,
        )
        self._call(config, self.timeout, reply=Int32)

    def _eom_options(self, eom: bytes) -> int:
        return _SET_EOM if eom else 0


class Gpib(Instrument):
    """The instrument at an address of a GPIB bus: 0 to 30, or 100 * primary + secondary address."""

    def __init__(
        self,
        server: str,
        address: int,
        location: int | None = None,
        *,
        backplane: str = "",
        timeout: float = 1.0,
        queue_timeout: float = QUEUE_TIMEOUT,
    ) -> None:
        super().__init__(
            server,
            address,
            location,
            backplane=backplane,
            timeout=timeout,
            queue_timeout=queue_timeout,
            status_texts=_GPIB_STATUS,
        )

    def poll(self, timeout: float | None = None) -> int:
        """A serial poll; returns the status byte."""
        return self._ask(_POLL, timeout=timeout).value[0]

    def clear(self, timeout: float | None = None) -> None:
        """Selected device clear."""
        self._ask(_CLEAR, timeout=timeout)

    def trigger(self, timeout: float | None = None) -> None:
        """Group execute trigger of this instrument."""
        self._ask(_TRIGGER, timeout=timeout)

    def lease(self, duration: float, holder: str = "", timeout: float | None = None) -> float:
        """Makes the bus exclusive to this object, for `duration` [s]; returns the time that the
        server granted.

        holder: a name for the messages that others get.
        """
        reply = self._ask(_LEASE, holder, round(duration * 1000), timeout)
        return reply.extra / 1000

    def unlease(self) -> None:
        """Ends the lease."""
        self._ask(_UNLEASE)
