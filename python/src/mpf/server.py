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
from collections.abc import AsyncGenerator, Callable, Coroutine, Generator, Iterable
from types import AsyncGeneratorType, GeneratorType
from typing import Any, TypeVar, cast

from mpf import _mpf
from mpf._mpf import Message
from mpf.closing import Closing
from mpf.ending import at_sigterm, close_at_exit
from mpf.errors import Error, QueueFull
from mpf.failure_log import FailureLog
from mpf.replies import NoMoreReplies, NotHandled, needs_loop, of_error, text_of, with_value
from mpf.server_arguments import check_class, checked_mode, number_of_group, own_name_explained
from mpf.streams import Streams

M = TypeVar("M", bound=Message)
Self = TypeVar("Self")
Handler = Callable[[M], object]
H = TypeVar("H", bound=Callable[..., object])
Work = Coroutine[Any, Any, None]  # on one request

_log = logging.getLogger("mpf")
_NOT_HERE = (Error, RuntimeError)  # the server is closed, or that of a parent process
_PAUSE = 0.001  # [s] between attempts to send a reply to a full queue


class Server(Closing, _mpf.BaseServer):
    """A server with this name.

    location: by default MPF_LOCATION, or 0.
    backplane: the name of the backplane; by default MPF_BACKPLANE, or "default".
    queue_size: requests of one client that may wait, 1 to 16384.
    max_message_bytes: the largest request and reply [bytes].
    max_borrowed: published messages that one client may hold, 1 to 64; see publish().
    wait: "adaptive", "spin" or "block", as for a client.
    mode, group: which users may be clients, as the options --mode and --group of the programs of
        MPF; by default only the user of this process. `mode=0o660, group="mpf"` admits the members
        of this group, for example the router.

    Raises NameInUse if this or another process serves this name, OSError if there is no memory in
    /dev/shm, ValueError if an argument is invalid.
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
        mode: int = 0o600,
        group: str | None = None,
    ) -> None:
        with own_name_explained(name):
            super().__init__(
                name,
                location,
                backplane=backplane,
                queue_size=queue_size,
                max_message_bytes=max_message_bytes,
                max_borrowed=max_borrowed,
                wait=wait,
                mode=checked_mode(mode),
                group=None if group is None else number_of_group(group),
            )
        self._handlers: dict[type[Message], Callable[[Any], object]] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        self._closing: set[asyncio.Task[Any] | None] = set()  # that have called close()
        self._streams = Streams()
        self._failures = FailureLog(self.name)
        self._thread: threading.Thread | None = None
        self._state = threading.Condition()  # guards the next two
        self._runner: threading.Thread | None = None  # run() or serve() is in progress there
        self._closesAtEnd = False
        self._isFinishing = False  # coroutines end before run() does
        close_at_exit(self)

    def on(self, type: type[M]) -> Callable[[H], H]:
        """Makes a function, a coroutine function or another callable object the handler of requests
        of this class. With `mpf.Message`, it handles all requests that have no other handler;
        without one they get an error.

        It replaces the handler that the class had, also while the server runs.
        """
        check_class(type)

        def register(handler: H) -> H:
            if not callable(handler):
                raise TypeError(f"on: {handler!r} is not a function")
            self._handlers[type] = handler
            return handler

        return register

    def run(self) -> None:
        """Handles requests until interrupt() or close(); in the main thread also until SIGTERM or
        Ctrl-C. Coroutines run in an event loop of its own, at the same time; functions run one
        after the other.

        At SIGTERM, handlers in progress first end and reply, but generators are closed; a second
        SIGTERM ends the process. A program that handles SIGTERM itself keeps its handler. Ctrl-C
        raises KeyboardInterrupt in a function in progress, whose request ends as Refused.

        SystemExit leaves run(); the request of the handler that raised it ends as Refused.
        """
        try:
            with at_sigterm(self._finish):
                if any(inspect.iscoroutinefunction(h) or inspect.isasyncgenfunction(h)
                       for h in self._handlers.values()):
                    asyncio.run(self.serve())
                else:
                    self._run()
        except KeyboardInterrupt:
            if threading.current_thread() is not threading.main_thread():
                raise  # it is not that of Ctrl-C

    def start(self: Self) -> Self:
        """Calls run() in a thread, which close() ends, and the end of the program. The server goes
        on if the program only drops it.

        A handler that raises SystemExit or KeyboardInterrupt closes the server; the log has the
        traceback.
        """
        server = cast(Server, self)
        server._fileno()  # raises if it is closed
        if server._thread is not None:
            raise RuntimeError(f"{server.name}: start() was called before")
        if server._runner is not None:
            raise RuntimeError(f"{server.name}: the server runs already")
        server._thread = threading.Thread(
            target=server._run_in_thread, name=f"mpf {server.name}", daemon=True
        )
        server._thread.start()
        return self

    def _run_in_thread(self) -> None:
        try:
            self.run()
        except BaseException:
            _log.critical("%s: the server is closed, because run() ended by", self.name,
                          exc_info=True)
            self._close()

    def close(self) -> None:
        """Ends run() and serve(), and disconnects all clients: waiting requests end as NeverTaken.
        In a handler, it ends them after the handler. In another thread, it waits for their end."""
        with self._state:
            if self._runner is not None or self._thread is not None:
                self._interrupt()
            if self._runner is threading.current_thread():
                self._closesAtEnd = True
                with contextlib.suppress(RuntimeError):  # no event loop runs in this thread
                    self._closing.add(asyncio.current_task())
                return
            # After a fork, the thread that runs the server exists only in the parent.
            while self._runner is not None and self._runner.is_alive():
                self._interrupt()  # it may have begun to run once more
                self._state.wait(1)
        if (thread := self._thread) is not None:
            thread.join()
            self._thread = None
        self._close()

    def _interrupt(self) -> None:
        with contextlib.suppress(*_NOT_HERE):
            self.interrupt()

    def _finish(self) -> None:
        self._isFinishing = True
        self._interrupt()

    def reply(self, request: Message, value: object = None) -> bool:
        """Sends a reply to the client of `request`: a message or a value, as a handler returns it.
        The first reply ends the request; any number may follow. Any thread; never waits.

        Returns False when the client has gone. Raises QueueFull when the client does not take
        further replies, and TooLarge.
        """
        if value is None:
            return self._reply(request, request)
        if isinstance(value, Message):
            return self._reply(request, value)
        return self._reply(request, with_value(request, value))

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
        await self._serve(self._running())

    @contextlib.contextmanager
    def _running(self) -> Generator[None]:
        with self._state:
            if self._runner is not None:
                raise RuntimeError(f"{self.name}: the server runs already")
            self._runner = threading.current_thread()
        try:
            yield
        finally:
            self._failures.flush()
            with self._state:
                self._runner = None
                self._isFinishing = False
                if self._closesAtEnd:
                    self._close()
                self._state.notify_all()

    async def _serve(
        self, running: contextlib.AbstractContextManager[object], begun: Work | None = None
    ) -> None:
        with running:
            loop = asyncio.get_running_loop()
            descriptor = self._fileno()
            readable = asyncio.Event()
            loop.add_reader(descriptor, readable.set)
            try:
                if begun is not None:
                    await self._start(begun)
                while not self._take_interrupt():
                    while (request := self._receive(0)) is not None:
                        await self._start(self._serve_one(request))
                    self._streams.look_soon()  # a client may have gone
                    await readable.wait()
                    readable.clear()
            finally:
                loop.remove_reader(descriptor)
                self._streams.stop_looking()
                if self._isFinishing and (tasks := self._tasks - self._streams.tasks()):
                    await asyncio.wait(tasks)
                for task in self._tasks - self._closing:
                    task.cancel()
                await asyncio.gather(*self._tasks, return_exceptions=True)

    # ---- requests

    def _run(self) -> None:
        with contextlib.ExitStack() as running:
            running.enter_context(self._running())
            if (begun := self._run_functions()) is not None:  # the rest runs in an event loop
                asyncio.run(self._serve(running, begun))

    def _run_functions(self) -> Work | None:
        """Runs until an interrupt, or until a handler needs an event loop: returns its work."""
        while True:
            request = self._receive(math.inf)
            if request is not None:
                if (result := self._handle_one(request)) is not None:
                    return self._end_one(request, result)
            elif self._take_interrupt():
                return None
            request = None  # frees its elements

    def _handle_one(self, request: Message) -> object:
        """Calls the handler and replies; returns what needs an event loop instead."""
        try:
            result = self._handle(request)
            if needs_loop(result):
                return result
            self._answer(request, result)
        except NoMoreReplies:
            pass
        except (SystemExit, KeyboardInterrupt):
            self._give_up(request)
            raise
        except BaseException as error:  # also CancelledError: a function is not a task
            self._fail(request, error)
        return None

    async def _start(self, work: Work) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        await asyncio.sleep(0)

    async def _serve_one(self, request: Message) -> None:
        if (result := self._handle_one(request)) is not None:
            await self._end_one(request, result)

    async def _end_one(self, request: Message, result: object) -> None:
        try:
            if inspect.isawaitable(result):
                result = await result
            if isinstance(result, AsyncGeneratorType):
                await self._answer_each(request, cast(AsyncGenerator[object], result))
            else:
                self._answer(request, result)
        except NoMoreReplies:
            pass
        except Exception as error:
            self._fail(request, error)
        except (SystemExit, KeyboardInterrupt):
            self._give_up(request)
            raise

    async def _answer_each(self, request: Message, values: AsyncGenerator[object]) -> None:
        hasReplied = False
        async with contextlib.aclosing(values):
            with self._streams.running(lambda: self.is_client_connected(request)):
                async for value in values:
                    while not self._try_reply(request, value):
                        await asyncio.sleep(_PAUSE)
                    hasReplied = True
        if not hasReplied:
            self.refuse(request)

    def _handle(self, request: Message) -> object:
        handler = self._handlers.get(type(request), self._handlers.get(Message))
        if handler is None:
            raise NotHandled(f"{self.name} does not handle {type(request).__name__} messages")
        return handler(request)

    def _answer(self, request: Message, result: object) -> None:
        if not isinstance(result, GeneratorType):
            self.reply(request, result)
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
        if self._is_interrupted or self._isFinishing or self._closesAtEnd:
            raise NoMoreReplies
        try:
            wasSent = self.reply(request, value)
        except QueueFull:
            wasSent = False
            if self.is_client_connected(request):
                return False
        if not wasSent:
            raise NoMoreReplies
        return True

    def _give_up(self, request: Message) -> None:
        with contextlib.suppress(*_NOT_HERE):
            self.refuse(request)

    def _fail(self, request: Message, error: BaseException) -> None:
        level = logging.DEBUG if isinstance(error, NotHandled) else logging.ERROR
        self._failures.write(level, "%r failed: %s", request, text_of(error), error=error)
        try:
            self._reply(request, of_error(request, error))
        except Error as failure:
            self._failures.write(logging.ERROR, "%s", failure)
