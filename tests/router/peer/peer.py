# SPDX-License-Identifier: MIT
# One end of a connection between routers, for both roles: sends the greeting, writes and reads
# frames, answers pings, checks signs of life, and sends the farewell. client_role.py and
# server_role.py handle the other items.
#
# Threads  each connection has a thread, which calls its role with `changed` held. Any thread may
#          call send(), leave() and await_().
# Trust    a violation of docs/wire-format.md raises Violation, which ends the connection with a
#          farewell.
import itertools
import os
import select
import socket
import threading
import time
from collections import Counter

from codec import FrameReader, NoFrame, TooLong, encodeFrame, decodeFrame, item
from layouts import kLayouts, kNewerLayouts, kOlderLayouts

kMajor = 1
kLeastFrameBytes = 65536
kReadBytes = 65536
kFromClientRouter = frozenset(("bind", "unbind", "open", "close", "request", "credit"))
kFromServerRouter = frozenset(("server", "refuse", "reply", "fate", "queueFull"))
_lives = itertools.count(os.getpid() << 20 | 1)


class Violation(Exception):
  """The other side violated the protocol or fell silent: the farewell's code and reason."""


class Ended(Exception):
  """The connection has ended while a test waits for something."""


def greeting(**fields):
  """The body of a greeting for tests; deadTimeMs is long, because the host may be busy."""
  return {
    "protocolMajor": kMajor,
    "protocolMinor": 0,
    "router": "peer",
    "program": "a peer for tests",
    "incarnation": next(_lives),
    "maxFrameBytes": 1 << 20,
    "maxMessageBytes": 1 << 19,
    "deadTimeMs": 20000,
    "maxClients": 100,
    **fields,
  }


def bodyBytes(message):
  """The bytes that maxMessageBytes and the window count: those of elements or of a `user` value."""
  perElement = {"int32Array": 4, "float64Array": 8, "char8Array": 1, "user": 1}.get(
    message["kind"], 0
  )
  return perElement and perElement * len(message["body"].get("value", ()))


def mustBeCarried(message):
  if message["kind"] == "char8Array" and len(message["body"]["eomString"]) > 4:
    raise Violation("protocol", "eomString has room for 4 bytes")


class Connection(threading.Thread):
  """
  connected  a connected socket; this object closes it
  role       has changed, kTakes (the kinds of items that it handles), onGreeting(),
             onItem(kind, body), nextTime(), onTime(now) and onEnd()
  mine       the body of the greeting; None: sends no greeting
  version    "": protocol 1.0; "newer": a later minor version, with additional fields and with
             items of unknown kinds around each item; "older": an earlier one, with fewer fields
  spread     writes each object to a segment of its own
  """

  def __init__(self, connected, role, mine, version="", spread=False):
    super().__init__(daemon=True)
    self.socket_ = connected
    self.role_ = role
    self.mine = mine
    self.version_ = version
    self.spread_ = spread
    self.theirs = None      # body of their greeting
    self.ending = None      # (sender of the farewell: "theirs", "mine" or "none"; code; reason)
    self.answersPings = True
    self.counts = Counter()  # received items, by kind
    self.stamps = []         # of the received pongs
    self.waiting_ = []
    self.out_ = bytearray()
    self.wakeReceiver_, self.wakeSender_ = socket.socketpair()
    for end in (self.socket_, self.wakeReceiver_, self.wakeSender_):
      end.setblocking(False)
    self.socket_.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

  # ---- for any thread

  def send(self, *items):
    with self.role_.changed:
      self.waiting_ += items
    self.wake()

  def sendBytes(self, raw):
    """Sends bytes without any check."""
    with self.role_.changed:
      self.out_ += raw
    self.wake()

  def leave(self, code="stopping", reason=""):
    with self.role_.changed:
      self.waiting_.append(item("farewell", code=code, reason=reason))
      self.ending = self.ending or ("mine", code, reason)
      self.role_.changed.notify_all()
    self.wake()

  def await_(self, holds, afterEnd=False):
    """Waits until `holds()`, without a time limit: the test has a watchdog."""
    with self.role_.changed:
      while not holds():
        if self.ending and not afterEnd:
          raise Ended(self.ending)
        self.role_.changed.wait()

  def awaitEnding(self):
    self.await_(lambda: self.ending, afterEnd=True)
    self.join()
    return self.ending[:2]

  # ---- its own thread

  def run(self):
    try:
      if self.mine:
        self.out_ += self.encoded([item("greeting", self.mine)])
      self.serve()
    except Violation as violation:
      self.end("mine", *violation.args)
      self.out_ += self.encoded(
        [item("farewell", code=violation.args[0], reason=violation.args[1])]
      )
    except OSError as error:
      self.end("none", None, str(error))
    finally:
      self.end("none", None, "a defect of the peer")  # no effect when it has ended before
      with self.role_.changed:
        self.role_.onEnd()
        self.role_.changed.notify_all()
      self.drain()
      with self.role_.changed:
        for end in (self.socket_, self.wakeReceiver_, self.wakeSender_):
          end.close()

  def end(self, sender, code, why):
    with self.role_.changed:
      self.ending = self.ending or (sender, code, why)

  def serve(self):
    reader = FrameReader(kLeastFrameBytes)
    deadTime = self.mine["deadTimeMs"] / 1000 if self.mine else 3600
    lastReceive = lastPing = time.monotonic()
    partialBytes = 0
    while True:
      now = time.monotonic()
      if now > lastReceive + deadTime:
        raise Violation("silence", f"nothing for {deadTime} s")
      if self.theirs and now >= lastPing + deadTime / 4:
        lastPing = now
        self.send(item("ping", stamp=time.monotonic_ns()))
      with self.role_.changed:
        if self.theirs:
          self.role_.onTime(now)
        self.fill()
        if self.ending and not self.out_:
          return
        wanted = [self.socket_] if self.out_ else []
        times = [
          lastReceive + deadTime,
          lastPing + deadTime / 4 if self.theirs else None,
          self.role_.nextTime(),
        ]
      wait = max(0, min(when for when in times if when is not None) - now)
      readable, writable, _ = select.select([self.socket_, self.wakeReceiver_], wanted, [], wait)
      if self.wakeReceiver_ in readable:
        self.wakeReceiver_.recv(kReadBytes)
      if writable:
        with self.role_.changed:
          del self.out_[:self.socket_.send(self.out_)]
      if self.socket_ in readable:
        received = self.socket_.recv(kReadBytes)
        if not received:
          return self.end("none", None, "closed without a farewell")
        reader.feed(received)
        partialBytes += len(received)
        if self.takeFrames(reader) or partialBytes >= 65536:
          lastReceive, partialBytes = time.monotonic(), 0

  def takeFrames(self, reader):
    """Handles all complete frames; returns whether there was one."""
    count = 0
    with self.role_.changed:
      try:
        while not self.ending and (segments := reader.tryNext()) is not None:
          count += 1
          self.takeItems(decodeFrame(segments))
          reader.maxBytes = self.mine["maxFrameBytes"] if self.mine else kLeastFrameBytes
      except TooLong as error:
        raise Violation("limit", str(error)) from error
      except NoFrame as error:
        raise Violation("protocol", str(error)) from error
      self.role_.changed.notify_all()
    return count > 0

  def takeItems(self, items):
    for one in items:
      kind, body = one["kind"], one["body"]
      self.counts[kind] += 1
      if kind == "farewell":
        self.end("theirs", body["code"], body["reason"])
        self.out_.clear()
        return
      if self.theirs is None:
        self.takeGreeting(kind, body)
      elif kind == "ping":
        if self.answersPings:
          self.send(item("pong", body))
      elif kind == "pong":
        self.stamps.append(body["stamp"])
      elif kind in self.role_.kTakes:
        self.role_.onItem(kind, body)
      elif kind in kFromClientRouter or kind in kFromServerRouter:
        raise Violation("protocol", f"{kind} is not for this side")

  def takeGreeting(self, kind, body):
    if kind != "greeting":
      raise Violation("protocol", "no greeting")
    if body["protocolMajor"] != kMajor:
      raise Violation("version", f"major version {body['protocolMajor']}, not {kMajor}")
    if body["maxFrameBytes"] < kLeastFrameBytes:
      raise Violation("protocol", "maxFrameBytes is less than 65536")
    self.theirs = body
    self.role_.onGreeting(body)

  def fill(self):
    """Writes waiting items as frames, once the greeting of the other side has arrived."""
    if self.theirs and self.waiting_:
      items, self.waiting_ = self.waiting_, []
      if self.version_ == "newer":
        items = [
          item("novelty", "?"),
          *(new for old in items for new in (old, item(0xFFFF, {}))),
          item("novelty", "!"),
        ]
      self.out_ += self.frames(items)

  def frames(self, items):
    whole = self.encoded(items)
    if len(whole) <= self.theirs["maxFrameBytes"] or len(items) == 1:
      return whole
    half = len(items) // 2
    return self.frames(items[:half]) + self.frames(items[half:])

  def fits(self, one):
    return len(self.encoded([one])) <= self.theirs["maxFrameBytes"]

  def encoded(self, items):
    layouts = {"newer": kNewerLayouts, "older": kOlderLayouts}.get(self.version_, kLayouts)
    return encodeFrame(items, layouts, self.spread_ and len(items) < 8)

  def drain(self):
    """Writes what is left, then reads until the other side closes; unread data would cause a reset,
    and the other side might lose the farewell."""
    try:
      while self.out_:
        select.select([], [self.socket_], [])
        del self.out_[:self.socket_.send(self.out_)]
      self.socket_.shutdown(socket.SHUT_WR)
      while self.socket_ in select.select([self.socket_], [], [], 5)[0] and self.socket_.recv(
        kReadBytes
      ):
        pass
    except OSError:
      pass

  def wake(self):
    with self.role_.changed:
      try:
        self.wakeSender_.send(b"!")
      except OSError:
        pass  # a wake-up is already pending, or the connection has ended
