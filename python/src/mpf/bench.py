# SPDX-License-Identifier: MIT
"""`python -m mpf.bench`: round trips from Python, by MPF and by other packages.

Client and server are processes of Python on a processor each. All rows are measured in each of
several rounds, so that a disturbance does not hit one of them alone; a row has the percentiles of
all rounds. `typical` is the median over groups of 100 round trips that are timed as a whole.
Packages that are not installed are omitted. The rows of C++ come from `mpf-bench`, if it is beside
the program mpf.
"""

from __future__ import annotations

import argparse
import asyncio
import atexit
import contextlib
import ctypes
import importlib
import importlib.util
import json
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import mpf
from mpf import program

_GROUP = 100
_IMAGE_BYTES = 4 << 20
_SUBSCRIPTIONS = 1000  # of one client
_REPLIES = 100  # to each, besides the first
Call = Callable[[], Any]


# ---- servers; each runs in a process of its own


def _serve_mpf(ready: Any, name: str, wait: str) -> None:
    server = mpf.Server(name, wait=wait)
    image = mpf.Float64Array(np.ones(_IMAGE_BYTES // 8))

    @server.on(mpf.Int32)
    def echo(request: mpf.Int32) -> None:  # pyright: ignore[reportUnusedFunction]
        return None

    @server.on(mpf.OutOfBand)
    def copied(request: mpf.OutOfBand) -> object:  # pyright: ignore[reportUnusedFunction]
        return image

    @server.on(mpf.Float64)
    def handed_over(request: mpf.Float64) -> object:  # pyright: ignore[reportUnusedFunction]
        return server.loan(request, mpf.Float64Array, _IMAGE_BYTES // 8)

    ready.set()
    server.run()


def _serve_subscriptions(ready: Any, name: str) -> None:
    """Replies to all subscriptions in turn, as soon as the last one was made."""
    server = mpf.Server(name, queue_size=_SUBSCRIPTIONS)
    subscribers: list[mpf.Int32] = []

    @server.on(mpf.Int32)
    def subscribe(request: mpf.Int32) -> object:  # pyright: ignore[reportUnusedFunction]
        server.reply(request, mpf.Int32(-1))
        subscribers.append(request)
        if len(subscribers) < _SUBSCRIPTIONS:
            return mpf.Int32(0)
        for number in range(1, _REPLIES):
            for one in subscribers:
                while not server._try_reply(one, mpf.Int32(number)):
                    time.sleep(0.0002)
        return mpf.Int32(_REPLIES)

    ready.set()
    server.run()


def _serve_pipe(ready: Any, end: Any) -> None:
    image = bytes(_IMAGE_BYTES)
    ready.set()
    with contextlib.suppress(EOFError):
        while True:
            asked = end.recv()
            if asked >= 0:
                end.send(asked)
            else:
                end.send_bytes(image)


def _serve_zmq(ready: Any, address: str) -> None:
    zmq: Any = importlib.import_module("zmq")
    socket = zmq.Context().socket(zmq.REP)
    socket.bind(address)
    ready.set()
    image = bytes(_IMAGE_BYTES)
    while True:
        asked = socket.recv()
        socket.send(image if asked == b"image" else asked)


def _serve_iceoryx2(ready: Any, name: str) -> None:
    server = _iceoryx2_service(name).server_builder().create()
    ready.set()
    while True:
        request = server.receive()
        if request is not None:
            value = request.payload().contents.value
            request.loan_uninit().write_payload(ctypes.c_int32(value)).send()


def _iceoryx2_service(name: str) -> Any:
    iceoryx2: Any = importlib.import_module("iceoryx2")
    iceoryx2.set_log_level_from_env_or(iceoryx2.LogLevel.Error)
    node = iceoryx2.NodeBuilder.new().create(iceoryx2.ServiceType.Ipc)
    builder = node.service_builder(iceoryx2.ServiceName.new(name))
    return builder.request_response(ctypes.c_int32, ctypes.c_int32).open_or_create()


# ---- clients: the calls to be timed


def _mpf_calls(client: mpf.Client, many: mpf.AsyncClient, wait: str) -> dict[str, Call]:
    request = mpf.Int32(1)

    def image(message: mpf.Message) -> Call:
        return lambda: client.call(message, reply=mpf.Float64Array).value

    calls: dict[str, Call] = {f"mpf, {wait}": lambda: client.call(request)}
    if wait == "spin":
        loop = asyncio.new_event_loop()
        calls["mpf, 4 MiB handed over"] = image(mpf.Float64())
        calls["mpf, 4 MiB, one copy"] = image(mpf.OutOfBand())
        calls["mpf, asyncio"] = lambda: loop.run_until_complete(many.call(request))
    return calls


def _iceoryx2_call(name: str) -> Call:
    client = _iceoryx2_service(name).client_builder().create()

    def call() -> int:
        pending = client.loan_uninit().write_payload(ctypes.c_int32(1)).send()
        while (reply := pending.receive()) is None:
            pass
        return int(reply.payload().contents.value)

    return call


def _zmq_calls(address: str) -> dict[str, Call]:
    zmq: Any = importlib.import_module("zmq")
    socket = zmq.Context().socket(zmq.REQ)
    socket.connect(address)

    def asking(data: bytes) -> Call:
        return lambda: (socket.send(data), socket.recv())

    return {"pyzmq": asking(b"1234"), "pyzmq, 4 MiB": asking(b"image")}


def _pipe_calls(end: Any) -> dict[str, Call]:
    return {
        "multiprocessing.Pipe": lambda: (end.send(1), end.recv()),
        "multiprocessing.Pipe, 4 MiB": lambda: (end.send(-1), end.recv_bytes()),
    }


class _Bench:
    """All rows of one round; the server of a row lives as long as its calls are timed."""

    def __init__(self, server_cpu: int) -> None:
        self._server_cpu = server_cpu
        self._name = f"bench-{os.getpid()}"
        self._context = multiprocessing.get_context("spawn")

    def rows(self) -> Iterator[tuple[str, Call]]:
        for wait in ("spin", "block"):
            with self._serving(_serve_mpf, self._name, wait), mpf.Client(
                self._name, wait=wait
            ) as client:
                many = mpf.AsyncClient(self._name, wait=wait)
                yield from _mpf_calls(client, many, wait).items()
                many.close()
        near, far = self._context.Pipe()
        with self._serving(_serve_pipe, far):
            yield from _pipe_calls(near).items()
        if importlib.util.find_spec("zmq"):
            address = f"ipc://{tempfile.gettempdir()}/{self._name}"
            with self._serving(_serve_zmq, address):
                yield from _zmq_calls(address).items()
        if importlib.util.find_spec("iceoryx2"):
            with self._serving(_serve_iceoryx2, self._name):
                yield "iceoryx2, spin", _iceoryx2_call(self._name)

    def replies_per_second(self) -> float:
        """To all subscriptions together."""
        with self._serving(_serve_subscriptions, self._name), mpf.Client(self._name) as client:
            subscriptions = [
                client.subscribe(mpf.Int32(), limit=_REPLIES) for _ in range(_SUBSCRIPTIONS)
            ]
            for one in subscriptions[:-1]:
                next(one)
            begin = time.perf_counter()
            next(subscriptions[-1])
            for _ in range(_REPLIES):
                for one in subscriptions:
                    next(one)
            duration = time.perf_counter() - begin
            assert sum(one.missed for one in subscriptions) == 0
            return _SUBSCRIPTIONS * _REPLIES / duration

    @contextlib.contextmanager
    def _serving(self, target: Callable[..., None], *values: Any) -> Generator[None]:
        ready = self._context.Event()
        process = self._context.Process(target=target, args=(ready, *values), daemon=True)
        process.start()
        try:
            assert process.pid is not None
            os.sched_setaffinity(process.pid, {self._server_cpu})
            ready.wait()
            yield
        finally:
            process.kill()
            process.join()


# ---- measuring


class _Times:
    """[ns] of single calls, and of calls in groups."""

    def __init__(self) -> None:
        self._single: list[int] = []
        self._groups: list[float] = []

    def measure(self, call: Call, seconds: float) -> None:
        now = time.perf_counter_ns
        for _ in range(10):
            call()
        end = now() + int(seconds * 1e9)
        while now() < end:
            begin = now()
            for _ in range(_GROUP):
                call()
            self._groups.append((now() - begin) / _GROUP)
            for _ in range(_GROUP):
                begin = now()
                call()
                self._single.append(now() - begin)

    def columns(self) -> list[float]:
        ordered = sorted(self._single)
        at = [ordered[min(len(ordered) - 1, int(len(ordered) * part))] for part in
              (0.5, 0.99, 0.999)]
        return [statistics.median(self._groups), *at]


def _cpp_rows() -> dict[str, list[float]]:
    """Rows of `mpf bench local` for the same round trip, and their floors."""
    path = Path(program.find()).with_name("mpf-bench")
    if not path.exists():
        return {}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "rows.json")
        command = [str(path), "local", "--quick", "--only", "Round trip of 4 B: MPF"]
        done = subprocess.run([*command, "--json", str(file)], capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            sys.exit(f"\n{path.name} failed:\n{done.stderr}")
        rows: list[dict[str, Any]] = json.loads(file.read_text())
    columns = ("typical_ns", "p50_ns", "p99_ns", "p999_ns")
    return {f"{row['name']} in C++, {row['mode']}": [row[one] for one in columns] for row in rows}


def _print(rows: dict[str, list[float]]) -> None:
    print(f"{'[us]':32}{'typical':>10}{'p50':>10}{'p99':>10}{'p99.9':>10}")
    for name, columns in rows.items():
        print(f"{name:32}" + "".join(f"{value / 1000:10.2f}" for value in columns))


def main() -> int:
    parser = argparse.ArgumentParser("python -m mpf.bench", description=__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="for each row in each round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--no-cpp", action="store_true", help="omit the rows of C++")
    everywhere = os.sched_getaffinity(0)
    parser.add_argument(
        "--cpus", default=f"{max(everywhere)},{min(everywhere)}", metavar="CLIENT,SERVERS",
        help="default: %(default)s",
    )
    arguments = parser.parse_args()
    client_cpu, server_cpu = (int(cpu) for cpu in arguments.cpus.split(","))
    os.environ["MPF_BACKPLANE"] = f"bench-{os.getpid()}"
    atexit.register(subprocess.run, [program.find(), "clean"], stdout=subprocess.DEVNULL)
    os.sched_setaffinity(0, {client_cpu})
    bench = _Bench(server_cpu)
    times: dict[str, _Times] = {}
    for number in range(arguments.rounds):
        for name, call in bench.rows():
            sys.stderr.write(f"\rround {number + 1} of {arguments.rounds}: {name:32}")
            times.setdefault(name, _Times()).measure(call, arguments.seconds)
    replies = bench.replies_per_second()
    os.sched_setaffinity(0, everywhere)
    sys.stderr.write("\rC++" + 48 * " ")
    rows = {name: one.columns() for name, one in times.items()}
    if not arguments.no_cpp:
        rows |= _cpp_rows()
    sys.stderr.write("\r" + 51 * " " + "\r")
    print(f"{os.uname().machine}, load {os.getloadavg()[0]:.2f}, client on CPU {client_cpu}, "
          f"servers on CPU {server_cpu}, Python {sys.version.split()[0]}")
    _print(rows)
    print(f"replies to {_SUBSCRIPTIONS} subscriptions of one client: {replies:,.0f} a second")
    return 0


if __name__ == "__main__":
    sys.exit(main())
