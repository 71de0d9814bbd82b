# SPDX-License-Identifier: MIT
"""FailureLog: the log of the requests of a server that failed, with as many lines as that of a
program of MPF: per level 32 at once, then one per 10 s, with the number of those that it replaces.
"""

from __future__ import annotations

import collections
import logging
import math
from time import monotonic
from types import TracebackType

AT_ONCE = 32  # failures
EVERY = 10.0  # [s] for each further one

_log = logging.getLogger("mpf")


class LogLimiter:
    """Decides which failures are logged, and counts the others."""

    def __init__(self) -> None:
        self.omitted = 0
        self._used_until = -math.inf  # 32 are allowed when this time is 32 * 10 s ago

    def admit(self, now: float) -> bool:
        used = max(self._used_until, now - AT_ONCE * EVERY)
        if used + EVERY > now:
            self.omitted += 1
            return False
        self._used_until = used + EVERY
        return True


class FailureLog:
    """Of one server; for the thread that runs it."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._limiters = collections.defaultdict[int, LogLimiter](LogLimiter)

    def write(
        self, level: int, text: str, *arguments: object, error: BaseException | None = None
    ) -> None:
        """Logs, with the traceback of `error` from the first function of the program on, if it has
        one."""
        limiter = self._limiters[level]
        if not _log.isEnabledFor(level) or not limiter.admit(monotonic()):
            return
        line = text % arguments  # now: a record must not keep a request
        if limiter.omitted:
            line += f" (the last of {limiter.omitted + 1} failures)"
            limiter.omitted = 0
        trace = _of_program(error.__traceback__) if error is not None else None
        cause = (type(error), error, trace) if error is not None and trace is not None else None
        _log.log(level, "%s: %s", self._name, line, exc_info=cause)

    def flush(self) -> None:
        """Logs how many failures were not logged. For the end of the server."""
        for level, limiter in self._limiters.items():
            if limiter.omitted:
                _log.log(level, "%s: %d more requests failed", self._name, limiter.omitted)
                limiter.omitted = 0


def _of_program(trace: TracebackType | None) -> TracebackType | None:
    while trace is not None and trace.tb_frame.f_globals.get("__package__") == __package__:
        trace = trace.tb_next
    return trace
