# SPDX-License-Identifier: MIT
"""Server: a server whose handlers are functions or coroutines.

    server = mpf.Server("doubler")

    @server.on(mpf.Int32)
    def double(request):
        return request.value * 2

    server.run()

What a handler returns is the reply:

    a message                 as it is
    a number, array or text   the request with this value, and status 0
    None                      the request itself, with the fields that the handler has changed
    a generator               each value that it yields is sent as one reply. It waits while the
                              client does not take them; a plain (not asynchronous) generator then
                              blocks the server's other requests

An exception becomes a reply with its text and a status: -1, or that of a StatusError. The client
gets it as a StatusError; a client in C++ gets a Char8Array.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
import math
import threading
import time
from collections.abc import AsyncGenerator, Callable, Generator, Iterable
from types import AsyncGeneratorType, GeneratorType, TracebackType
from typing import Any, TypeVar, cast

from mpf import _mpf
from mpf._mpf import Char8Array, Message
from mpf.errors import Error, QueueFull, StatusError

M = TypeVar("M", bound=Message)
Self = TypeVar("Self")
Handler = Callable[[M], object]
H = TypeVar("H", bound=Callable[..., object])

_log = logging.getLogger("mpf")
_PAUSE = 0.001  # [s] between attempts to send a reply to a full queue
_LOOK = 0.5  # [s] between looks whether the client of a generator has gone
_COPIED = ("timeout", "cmd", "address", "extra", "number_retrys", "eom")


class Server(_mpf.BaseServer):
    """A server with this name.

    location: by default MPF_LOCATION, or 0.
    backplane: the name of the backplane; by default MPF_BACKPLANE, or "default".
    queue_size: requests of one client that may wait, 1 to 16384.
    max_message_bytes: the largest request and reply [bytes].
    max_borrowed: published messages that one client may hold, 1 to 64; see publish().
    wait: "adaptive", "spin" or "block", as for a client.

    Raises NameInUse if another process serves this name, OSError if there is no memory in /dev/shm,
    ValueError if an argument is invalid.
    """

    def __init__(
        self,
        name: str,
        location: int | None = None,
        *,
        backplane: str = "",
        queue_size: int = 100,
        max_message_bytes: int = 64 << 20,
        max_borrowed: int = 4,
        wait: str = "adaptive",
    ) -> None:
        super().__init__(
            name,
            location,
            backplane=backplane,
            queue_size=queue_size,
            max_message_bytes=max_message_bytes,
            max_borrowed=max_borrowed,
            wait=wait,
        )
        self._handlers: dict[type[Message], Callable[[Any], object]] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        self._closing: set[asyncio.Task[Any]] = set()  # that have called close()
        self._streams: dict[asyncio.Task[Any], Message] = {}  # generators and their requests
        self._look: asyncio.TimerHandle | None = None  # at the clients of generators
        self._thread: threading.Thread | None = None
        self._state = threading.Condition()  # guards the next two
        self._runner: threading.Thread | None = None  # run() or serve() is in progress there
        self._closesAtEnd = False

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def on(self, type: type[M]) -> Callable[[H], H]:
        """Makes a function or a coroutine function the handler of requests of this class.
        With `mpf.Message`, the function handles all requests that have no other handler; without
        one they are refused."""

        _check_class(type)

        def register(handler: H) -> H:
            self._handlers[type] = handler
            return handler

        return register

    def run(self) -> None:
        """Handles requests until interrupt(), close() or Ctrl-C. Coroutines run in an event loop of
        its own, at the same time; functions run one after the other."""
        try:
            if any(inspect.iscoroutinefunction(h) or inspect.isasyncgenfunction(h)
                   for h in self._handlers.values()):
                asyncio.run(self.serve())
            else:
                with self._running():
                    self._run()
        except KeyboardInterrupt:
            pass

    def start(self: Self) -> Self:
        """Calls run() in a thread, which close() ends."""
        server = cast(Server, self)
        server._fileno()  # raises if it is closed
        if server._thread is not None:
            raise RuntimeError(f"{server.name}: start() was called before")
        server._thread = threading.Thread(target=server.run, name=f"mpf {server.name}", daemon=True)
        server._thread.start()
        return self

    def close(self) -> None:
        """Ends run() and serve(), and disconnects all clients: waiting requests end as NeverTaken.
        In a handler, it ends them after the handler. In another thread, it waits for their end."""
        with self._state:
            if self._runner is not None or self._thread is not None:
                self._interrupt()
            if self._runner is threading.current_thread():
                self._closesAtEnd = True
                if (task := _current_task()) is not None:
                    self._closing.add(task)
                return
            # After a fork, the thread that runs the server exists only in the parent.
            while self._runner is not None and self._runner.is_alive():
                self._interrupt()  # it may have begun to run once more
                self._state.wait(1)
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._close()

    def _interrupt(self) -> None:
        with contextlib.suppress(Error):  # it is closed, or that of a parent process
            self.interrupt()

    def publish(self, message: Message, requests: Iterable[M]) -> list[M]:
        """Sends `message` to the clients of all these requests, which read the same memory: for any
        number of clients, the elements are copied once. An array that loan_shared() returned is not
        copied at all, unless an array of numpy still refers to it; it is empty then.

        The first reply to a request ends it; any number may follow. Any thread; never waits.

        A client that holds `max_borrowed` published messages misses further ones until it frees
        one; Request.missed and Subscription.missed count them. No other client is affected.

        Returns the requests whose clients have gone. Raises TooLarge.
        """
        all_ = list(requests)
        connected = self._publish(message, cast("list[Message]", all_))
        return [request for request, has_client in zip(all_, connected) if not has_client]

    async def serve(self) -> None:
        """Handles requests in the running event loop until interrupt() or close()."""
        with self._running():
            await self._serve()

    @contextlib.contextmanager
    def _running(self) -> Generator[None]:
        with self._state:
            if self._runner is not None:
                raise RuntimeError(f"{self.name}: the server runs already")
            self._runner = threading.current_thread()
        try:
            yield
        finally:
            with self._state:
                self._runner = None
                if self._closesAtEnd:
                    self._close()
                self._state.notify_all()

    async def _serve(self) -> None:
        loop = asyncio.get_running_loop()
        descriptor = self._fileno()
        readable = asyncio.Event()
        loop.add_reader(descriptor, readable.set)
        try:
            while not self._take_interrupt():
                while (request := self._receive(0)) is not None:
                    await self._start(request)
                self._look_soon()  # a client may have gone
                await readable.wait()
                readable.clear()
        finally:
            loop.remove_reader(descriptor)
            if self._look is not None:
                self._look.cancel()
                self._look = None
            for task in self._tasks - self._closing:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

    # ---- requests

    def _run(self) -> None:
        while True:
            request = self._receive(math.inf)
            if request is not None:
                self._handle_one(request)
            elif self._take_interrupt():
                return
            request = None  # frees its elements

    def _handle_one(self, request: Message) -> None:
        try:
            self._answer(request, self._handle(request))
        except _NoMoreReplies:
            pass
        except Exception as error:
            self._fail(request, error)

    async def _start(self, request: Message) -> None:
        task = asyncio.ensure_future(self._serve_one(request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        await asyncio.sleep(0)

    async def _serve_one(self, request: Message) -> None:
        try:
            result = self._handle(request)
            if inspect.isawaitable(result):
                result = await result
            if isinstance(result, AsyncGeneratorType):
                await self._answer_each(request, cast(AsyncGenerator[object], result))
            else:
                self._answer(request, result)
        except _NoMoreReplies:
            pass
        except Exception as error:
            self._fail(request, error)

    async def _answer_each(self, request: Message, values: AsyncGenerator[object]) -> None:
        hasReplied = False
        async with contextlib.aclosing(values):
            with self._cancelled_without_client(request):
                async for value in values:
                    while not self._try_reply(request, value):
                        await asyncio.sleep(_PAUSE)
                    hasReplied = True
        if not hasReplied:
            self.refuse(request)

    @contextlib.contextmanager
    def _cancelled_without_client(self, request: Message) -> Generator[None]:
        """Cancels the current task when the client has gone: it may wait for something else."""
        task = asyncio.current_task()
        assert task is not None
        self._streams[task] = request
        self._look_soon()
        try:
            yield
        finally:
            del self._streams[task]

    def _look_soon(self) -> None:
        if self._streams and self._look is None:
            self._look = asyncio.get_running_loop().call_later(_LOOK, self._look_at_clients)

    def _look_at_clients(self) -> None:
        self._look = None
        for task, request in self._streams.items():
            if not self.is_client_connected(request):
                task.cancel()

    def _handle(self, request: Message) -> object:
        handler = self._handlers.get(type(request)) or self._handlers.get(Message)
        if handler is None:
            raise TypeError(f"{self.name} does not handle {type(request).__name__} messages")
        return handler(request)

    def _answer(self, request: Message, result: object) -> None:
        if not isinstance(result, GeneratorType):
            self._reply_with(request, result)
            return
        hasReplied = False
        with contextlib.closing(cast("Generator[object]", result)) as values:
            for value in values:
                while not self._try_reply(request, value):
                    time.sleep(_PAUSE)
                hasReplied = True
        if not hasReplied:
            self.refuse(request)

    def _try_reply(self, request: Message, value: object) -> bool:
        """Returns False while the client does not take the earlier replies."""
        if self._is_interrupted or self._closesAtEnd:
            raise _NoMoreReplies
        try:
            wasSent = self._reply_with(request, value)
        except QueueFull:
            wasSent = False
            if self.is_client_connected(request):
                return False
        if not wasSent:
            raise _NoMoreReplies
        return True

    def _reply_with(self, request: Message, value: object) -> bool:
        """Returns False when the client has gone."""
        if value is None:
            return self.reply(request, request)
        if isinstance(value, Message):
            return self.reply(request, value)
        return self.reply(request, _like(request, value))

    def _fail(self, request: Message, error: Exception) -> None:
        _log.error("%s: %r failed", self.name, request, exc_info=error)
        if isinstance(error, StatusError):
            status, text = _status_of(error), error.text
        else:
            status, text = -1, f"{type(error).__name__}: {error}"
        fields: dict[str, Any] = {**fields_of(request), "status": status}
        try:
            self.reply(request, Char8Array(text.encode("utf-8", "backslashreplace"), **fields))
        except Error as failure:
            _log.error("%s: %s", self.name, failure)


def _check_class(kind: object) -> None:
    if not (isinstance(kind, type) and issubclass(kind, Message)):
        raise TypeError(f"on: {kind!r} is not a class of messages, for example mpf.Int32")


def _current_task() -> asyncio.Task[Any] | None:
    try:
        return asyncio.current_task()
    except RuntimeError:  # no event loop runs in this thread
        return None


class _NoMoreReplies(Exception):
    """The client has gone, or the server ends."""


def _status_of(error: StatusError) -> int:
    isStatus = error.status != 0 and -(2**31) <= error.status < 2**31
    return error.status if isStatus else -1


def _like(request: Message, value: object) -> Message:
    """The request with this value."""
    kind = cast(Callable[..., Message], type(request))
    try:
        return kind(value, **fields_of(request))
    except TypeError as error:
        name = type(request).__name__
        raise TypeError(
            f"the handler returned {type(value)}, which is not the value of the reply "
            f"to {name} requests: return a message"
        ) from error


def fields_of(message: Message) -> dict[str, Any]:
    """The fields that a message has in common with another one of its kind: all but the value, the
    status and the time stamp."""
    return {name: getattr(message, name) for name in _COPIED if hasattr(message, name)}
