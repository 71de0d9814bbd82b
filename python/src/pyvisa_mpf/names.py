# SPDX-License-Identifier: MIT
"""The names of resources."""

from __future__ import annotations

import re
from dataclasses import dataclass

_NAME = re.compile(
    r"MPF(?P<location>-?\d+)?::(?P<server>.+?)(::(?P<primary>\d+)(::(?P<secondary>\d+))?)?"
    r"(::INSTR)?",
    re.IGNORECASE | re.ASCII,
)
_ALLOWED = {
    "location": range(-(2**31), 2**31),
    "primary": range(31),  # addresses of IEEE 488
    "secondary": range(31),
}


@dataclass(frozen=True)
class Name:
    """What a name of a resource says."""

    server: str
    location: int | None
    primary: int | None  # None: a serial server
    secondary: int | None

    @property
    def address(self) -> int:
        """As GPIB servers count: 100 * primary + secondary address."""
        primary = self.primary or 0
        return primary if self.secondary is None else 100 * primary + self.secondary


def parse(text: str) -> Name | None:
    """The parts of a name; None if it is not one."""
    match = _NAME.fullmatch(text)
    if match is None:
        return None
    numbers = {part: int(match[part]) if match[part] else None for part in _ALLOWED}
    if any(number is not None and number not in _ALLOWED[part] for part, number in numbers.items()):
        return None
    return Name(match["server"], **numbers)
