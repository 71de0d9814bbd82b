# SPDX-License-Identifier: MIT
"""`mpf bench python` measures each row."""

from __future__ import annotations

import subprocess

from conftest import PROGRAMS

ROWS = [
    "mpf, spin",
    "mpf, 4 MiB handed over",
    "mpf, 4 MiB, one copy",
    "mpf, asyncio",
    "mpf, block",
    "multiprocessing.Pipe",
    "multiprocessing.Pipe, 4 MiB",
    "pyzmq",
    "pyzmq, 4 MiB",
    "iceoryx2, spin",
    "cache-line bounce in C++, spin",
    "futex bounce in C++, block",
    "MPF in C++, spin",
    "MPF in C++, block",
]


def test_each_row_has_times_in_order() -> None:
    options = ["--rounds", "1", "--seconds", "0.01"]
    command = [PROGRAMS / "mpf", "bench", "python", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    times = {line[:32].strip(): line[32:].split() for line in done.stdout.splitlines()}
    for row in ROWS:
        _, *percentiles = [float(time) for time in times[row]]
        assert 0 < percentiles[0] <= percentiles[1] <= percentiles[2]
    assert "replies to 1000 subscriptions of one client" in done.stdout
