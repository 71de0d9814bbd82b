# SPDX-License-Identifier: MIT
# One end of a connection between routers, for both roles: greets, fills and cuts frames, answers pings, listens for signs of life,
# says farewell. client_role.py and server_role.py say what the items mean.
#
# Threads  each connection has one; it calls its role with `changed` held. send(), leave() and await_() are for any thread.
# Trust    what the page forbids raises Violation, which ends the connection with a farewell.
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
  """The other side did what the page forbids, or fell silent: the code of the farewell, and why."""


class Ended(Exception):
  """What is waited for cannot come any more."""


def greeting(**fields):
  """The body of a greeting with which a test can live; deadTimeMs is long, since the machine may be busy."""
  return {"protocolMajor": kMajor, "protocolMinor": 0, "router": "peer", "program": "a peer for tests", "incarnation": next(_lives),
          "maxFrameBytes": 1 << 20, "maxMessageBytes": 1 << 19, "deadTimeMs": 20000, "maxClients": 100, **fields}


def bodyBytes(message):
  """The bytes that maxMessageBytes and the window count: those of the elements of an array, or of the value of `user`."""
  perElement = {"int32Array": 4, "float64Array": 8, "char8Array": 1, "user": 1}.get(message["kind"], 0)
  return perElement and perElement * len(message["body"].get("value", ()))


def mustBeCarried(message):
  if message["kind"] == "char8Array" and len(message["body"]["eomString"]) > 4:
    raise Violation("protocol", "eomString has room for 4 bytes")


class Connection(threading.Thread):
  """
  socket   a connected one; its ends are closed here
  role     has changed, kTakes (kinds of items that it takes), onGreeting(), onItem(kind, body), nextTime(), onTime(now), onEnd()
  mine     body of the greeting; None: greets not at all
  version  of the sender, beside 1.0: "newer", a later minor version: structs with more fields, and items of unknown kinds around each
           one; "older", an earlier one: fewer fields
  spread   puts each object into a segment of its own
  """

  def __init__(self, connected, role, mine, version="", spread=False):
    super().__init__(daemon=True)
    self.socket_ = connected
    self.role_ = role
    self.mine = mine
    self.version_ = version
    self.spread_ = spread
    self.theirs = None      # body of their greeting
    self.ending = None      # how it ended: (who: "theirs", "mine" or "none"; code; why)
    self.answersPings = True
    self.counts = Counter()  # items that came, by kind
    self.stamps = []         # of the pongs that came
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
    """Past all that is careful here."""
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
    """Waits until `holds()`; there is no limit, a watchdog of the test's is meant to be there."""
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
      self.out_ += self.encoded([item("farewell", code=violation.args[0], reason=violation.args[1])])
    except OSError as error:
      self.end("none", None, str(error))
    finally:
      self.end("none", None, "a mistake in the peer")  # unless it has ended otherwise
      with self.role_.changed:
        self.role_.onEnd()
        self.role_.changed.notify_all()
      self.drain()
      with self.role_.changed:
        for end in (self.socket_, self.wakeReceiver_, self.wakeSender_):
          end.close()

  def end(self, who, code, why):
    with self.role_.changed:
      self.ending = self.ending or (who, code, why)

  def serve(self):
    reader = FrameReader(kLeastFrameBytes)
    deadTime = self.mine["deadTimeMs"] / 1000 if self.mine else 3600
    heard = pinged = time.monotonic()
    unheard = 0
    while True:
      now = time.monotonic()
      if now > heard + deadTime:
        raise Violation("silence", f"nothing for {deadTime} s")
      if self.theirs and now >= pinged + deadTime / 4:
        pinged = now
        self.send(item("ping", stamp=time.monotonic_ns()))
      with self.role_.changed:
        if self.theirs:
          self.role_.onTime(now)
        self.fill()
        if self.ending and not self.out_:
          return
        wanted = [self.socket_] if self.out_ else []
        times = [heard + deadTime, pinged + deadTime / 4 if self.theirs else None, self.role_.nextTime()]
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
          return self.end("none", None, "closed without a word")
        reader.feed(received)
        unheard += len(received)
        if self.takeFrames(reader) or unheard >= 65536:
          heard, unheard = time.monotonic(), 0

  def takeFrames(self, reader):
    """Whether at least one frame came whole."""
    came = 0
    with self.role_.changed:
      try:
        while not self.ending and (segments := reader.tryNext()) is not None:
          came += 1
          self.takeItems(decodeFrame(segments))
          reader.maxBytes = self.mine["maxFrameBytes"] if self.mine else kLeastFrameBytes
      except TooLong as error:
        raise Violation("limit", str(error)) from error
      except NoFrame as error:
        raise Violation("protocol", str(error)) from error
      self.role_.changed.notify_all()
    return came > 0

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
    """What waits becomes frames; nothing does before the other side has greeted."""
    if self.theirs and self.waiting_:
      items, self.waiting_ = self.waiting_, []
      if self.version_ == "newer":
        items = [item("novelty", "?"), *(new for old in items for new in (old, item(0xFFFF, {}))), item("novelty", "!")]
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
    """Writes what is left, then reads until the other side closes: a reset would take the farewell from it."""
    try:
      while self.out_:
        select.select([], [self.socket_], [])
        del self.out_[:self.socket_.send(self.out_)]
      self.socket_.shutdown(socket.SHUT_WR)
      while self.socket_ in select.select([self.socket_], [], [], 5)[0] and self.socket_.recv(kReadBytes):
        pass
    except OSError:
      pass

  def wake(self):
    with self.role_.changed:
      try:
        self.wakeSender_.send(b"!")
      except OSError:
        pass  # it is awake enough, or has ended
