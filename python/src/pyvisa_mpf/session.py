# SPDX-License-Identifier: MIT
"""Session: one open resource."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pyvisa import constants
from pyvisa.constants import ResourceAttribute, StatusCode

import mpf
from pyvisa_mpf.names import Name

_FOREVER = 24 * 3600.0  # [s] for VI_TMO_INFINITE; the server has a limit of its own
_OVERFLOW = 2  # a status of both servers: the rest of the answer comes with the next read
_STATUS = {
    1: StatusCode.error_timeout,
    3: StatusCode.error_io,
    4: StatusCode.error_no_listeners,
    5: StatusCode.error_nonsupported_operation,
    6: StatusCode.error_resource_locked,
    7: StatusCode.error_invalid_parameter,
}
_PARITY = {constants.Parity.none: "N", constants.Parity.odd: "O", constants.Parity.even: "E"}
_STOP_BITS = {constants.StopBits.one: 1, constants.StopBits.two: 2}
_DISCARD_RECEIVED = (
    constants.BufferOperation.discard_receive_buffer
    | constants.BufferOperation.discard_receive_buffer2
)
_DISCARD_READ = (
    constants.BufferOperation.discard_read_buffer
    | constants.BufferOperation.discard_read_buffer_no_io
    | _DISCARD_RECEIVED
)
_FLOW = {constants.ControlFlow.none: "N", constants.ControlFlow.rts_cts: "H"}


def status_of(error: Exception) -> StatusCode:
    """The status of VISA for an exception of mpf."""
    if isinstance(error, mpf.InstrumentError):
        return _STATUS.get(error.status, StatusCode.error_system_error)
    if isinstance(error, mpf.NotConnected):
        return StatusCode.error_connection_lost
    if isinstance(error, TimeoutError):
        return StatusCode.error_timeout
    if isinstance(error, KeyError):  # a setting that serial servers do not have
        return StatusCode.error_nonsupported_attribute_state
    return StatusCode.error_io


class Session:
    """Bytes that were read and not yet taken, and the attributes that a program has set."""

    def __init__(self, text: str, name: Name) -> None:
        is_gpib = name.primary is not None
        self.instrument: mpf.Serial | mpf.Gpib = (
            mpf.Gpib(name.server, name.address, name.location)
            if is_gpib
            else mpf.Serial(name.server, name.location)
        )
        interface = constants.InterfaceType.gpib if is_gpib else constants.InterfaceType.asrl
        self.attributes: dict[int, Any] = {
            ResourceAttribute.resource_name: text,
            ResourceAttribute.resource_class: "INSTR",
            ResourceAttribute.resource_manufacturer_name: "MPF",
            ResourceAttribute.interface_type: interface,
            ResourceAttribute.interface_number: name.location or 0,
            ResourceAttribute.interface_instrument_name: name.server,
            ResourceAttribute.timeout_value: 2000,
            ResourceAttribute.termchar: ord("\n"),
            ResourceAttribute.termchar_enabled: False,
            ResourceAttribute.send_end_enabled: True,
            ResourceAttribute.suppress_end_enabled: False,
        }
        if is_gpib:
            self.attributes[ResourceAttribute.gpib_primary_address] = name.primary
            self.attributes[ResourceAttribute.gpib_secondary_address] = (
                constants.VI_NO_SEC_ADDR if name.secondary is None else name.secondary
            )
        else:
            for attribute in (ResourceAttribute.asrl_end_in, ResourceAttribute.asrl_end_out):
                self.attributes[attribute] = constants.SerialTermination.none
        self._unread = b""
        self._is_complete = True  # with the unread bytes, the answer is complete

    def close(self) -> None:
        self.instrument.close()

    # ---- bytes

    def write(self, data: bytes) -> int:
        self._unread = b""
        self.instrument.write(data, self._timeout())
        return len(data)

    def read(self, count: int) -> tuple[bytes, StatusCode]:
        if not self._unread:
            self._unread, self._is_complete = self._receive()
        taken, self._unread = self._unread[:count], self._unread[count:]
        if self._unread or not self._is_complete:
            return taken, StatusCode.success_max_count_read
        termchar = self._termchar()
        if termchar and taken.endswith(termchar):
            return taken, StatusCode.success_termination_character_read
        return taken, StatusCode.success

    def _receive(self) -> tuple[bytes, bool]:
        """An answer, and whether it is complete."""
        try:
            return self.instrument.read(timeout=self._timeout(), eom=self._termchar()), True
        except mpf.InstrumentError as error:
            if error.status != _OVERFLOW:
                raise
            return error.answer, False

    def clear(self) -> None:
        self._unread = b""
        if isinstance(self.instrument, mpf.Gpib):
            self.instrument.clear(self._timeout())
        else:
            self.instrument.flush()

    def flush(self, mask: int) -> None:
        """Discards received bytes, if the mask says so: nothing is buffered for sending."""
        if mask & _DISCARD_READ:
            self._unread = b""
        if mask & _DISCARD_RECEIVED and isinstance(self.instrument, mpf.Serial):
            self.instrument.flush()

    def read_stb(self) -> int:
        return self._gpib().poll(self._timeout())

    def trigger(self) -> None:
        self._gpib().trigger(self._timeout())

    def _gpib(self) -> mpf.Gpib:
        if not isinstance(self.instrument, mpf.Gpib):
            raise NotImplementedError
        return self.instrument

    def _timeout(self) -> float:
        milliseconds = self.attributes[ResourceAttribute.timeout_value]
        return _FOREVER if milliseconds == constants.VI_TMO_INFINITE else milliseconds / 1000

    def _termchar(self) -> bytes:
        if not self.attributes[ResourceAttribute.termchar_enabled]:
            return b""
        return bytes([self.attributes[ResourceAttribute.termchar]])

    # ---- attributes

    def set(self, attribute: int, value: Any) -> StatusCode:
        configure = self._line_settings().get(attribute)
        if configure is not None:
            configure(value)
        elif attribute not in self.attributes:
            return StatusCode.error_nonsupported_attribute
        self.attributes[attribute] = value
        return StatusCode.success

    def _line_settings(self) -> dict[int, Callable[[Any], None]]:
        """How to change each setting of a serial line."""
        line = self.instrument
        if not isinstance(line, mpf.Serial):
            return {}
        return {
            ResourceAttribute.asrl_baud_rate: lambda v: line.configure(baud=v),
            ResourceAttribute.asrl_data_bits: lambda v: line.configure(bits_per_char=v),
            ResourceAttribute.asrl_parity: lambda v: line.configure(parity=_PARITY[v]),
            ResourceAttribute.asrl_stop_bits: lambda v: line.configure(stop_bits=_STOP_BITS[v]),
            ResourceAttribute.asrl_flow_control: lambda v: line.configure(flow_control=_FLOW[v]),
        }
