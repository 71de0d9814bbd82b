# SPDX-License-Identifier: MIT
"""MpfVisaLibrary: the functions of VISA that PyVISA calls."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, TypeVar

from pyvisa import constants, rname
from pyvisa.constants import StatusCode
from pyvisa.highlevel import ResourceInfo, VisaLibraryBase
from pyvisa.util import LibraryPath

import mpf
from pyvisa_mpf.names import parse
from pyvisa_mpf.session import Session, status_of

T = TypeVar("T")


class MpfVisaLibrary(VisaLibraryBase):
    """Instruments of MPF; see the package."""

    @staticmethod
    def get_library_paths() -> tuple[LibraryPath, ...]:
        return (LibraryPath("mpf"),)

    @staticmethod
    def get_debug_info() -> dict[str, str]:
        return {"Version": "MPF"}

    def _init(self) -> None:
        self._sessions: dict[int, Session] = {}
        self._numbers = itertools.count(1)

    # ---- resources

    def open_default_resource_manager(self) -> tuple[Any, StatusCode]:
        return next(self._numbers), self._return(None, StatusCode.success)

    def list_resources(self, session: Any, query: str = "?*::INSTR") -> tuple[str, ...]:
        names = [
            f"MPF{one['location']}::{one['name']}::INSTR"
            for one in mpf.servers()
            if one["program"].startswith("mpf-serial") and not one["name"].endswith(".sniff")
        ]
        return rname.filter(names, query)

    def parse_resource_extended(
        self, session: Any, resource_name: str
    ) -> tuple[ResourceInfo, StatusCode]:
        name = parse(resource_name)
        if name is None:
            return ResourceInfo(
                constants.InterfaceType.unknown, 0, None, None, None
            ), self._return(session, StatusCode.error_invalid_resource_name)
        interface = constants.InterfaceType.asrl
        if name.primary is not None:
            interface = constants.InterfaceType.gpib
        info = ResourceInfo(interface, name.location or 0, "INSTR", resource_name, None)
        return info, StatusCode.success

    def open(
        self,
        session: Any,
        resource_name: str,
        access_mode: constants.AccessModes = constants.AccessModes.no_lock,
        open_timeout: int = constants.VI_TMO_IMMEDIATE,
    ) -> tuple[Any, StatusCode]:
        name = parse(resource_name)
        if name is None:
            self._return(session, StatusCode.error_invalid_resource_name)
            raise AssertionError  # the line above raises
        number = next(self._numbers)
        self._sessions[number] = Session(resource_name, name)
        return number, self._return(number, StatusCode.success)

    def close(self, session: Any) -> StatusCode:
        opened = self._sessions.pop(session, None)
        if opened is not None:
            opened.close()
        return StatusCode.success

    # ---- operations

    def read(self, session: Any, count: int) -> tuple[bytes, StatusCode]:
        data, status = self._do(session, lambda opened: opened.read(count))
        return data, self._return(session, status)

    def write(self, session: Any, data: bytes) -> tuple[int, StatusCode]:
        count = self._do(session, lambda opened: opened.write(bytes(data)))
        return count, self._return(session, StatusCode.success)

    def clear(self, session: Any) -> StatusCode:
        self._do(session, Session.clear)
        return self._return(session, StatusCode.success)

    def flush(self, session: Any, mask: constants.BufferOperation) -> StatusCode:
        self._do(session, lambda opened: opened.flush(mask))
        return self._return(session, StatusCode.success)

    def read_stb(self, session: Any) -> tuple[int, StatusCode]:
        return self._do(session, Session.read_stb), self._return(session, StatusCode.success)

    def assert_trigger(self, session: Any, protocol: constants.TriggerProtocol) -> StatusCode:
        self._do(session, Session.trigger)
        return self._return(session, StatusCode.success)

    # ---- attributes, events

    def get_attribute(self, session: Any, attribute: Any) -> tuple[Any, StatusCode]:
        value = self._do(session, lambda opened: opened.attributes.get(attribute))
        status = StatusCode.success
        if value is None:
            status = StatusCode.error_nonsupported_attribute
        return value, self._return(session, status)

    def set_attribute(self, session: Any, attribute: Any, attribute_state: Any) -> StatusCode:
        status = self._do(session, lambda opened: opened.set(attribute, attribute_state))
        return self._return(session, status)

    def disable_event(self, session: Any, event_type: Any, mechanism: Any) -> StatusCode:
        return StatusCode.success

    def discard_events(self, session: Any, event_type: Any, mechanism: Any) -> StatusCode:
        return StatusCode.success

    # ---- results

    def _do(self, session: Any, operation: Callable[[Session], T]) -> T:
        """Raises VisaIOError for the exceptions of mpf."""
        opened = self._sessions.get(session)
        if opened is None:
            self._return(session, StatusCode.error_invalid_object)
            raise AssertionError  # the line above raises
        try:
            return operation(opened)
        except NotImplementedError:
            self._return(session, StatusCode.error_nonsupported_operation)
            raise
        except (mpf.Error, KeyError) as error:
            self._return(session, status_of(error))
            raise

    def _return(self, session: Any, status: StatusCode) -> StatusCode:
        return self.handle_return_value(session, status)
