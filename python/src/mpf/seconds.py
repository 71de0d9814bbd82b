# SPDX-License-Identifier: MIT
"""Times that a program gives [s]."""

from __future__ import annotations

import math


def checked_seconds(timeout: float) -> float:
    """Returns the time, which may be negative or infinite."""
    if math.isnan(timeout):
        raise ValueError("timeout: NaN is not a time")
    return timeout
