# SPDX-License-Identifier: MIT
# The peer as a server router: listens, and offers its servers to routers that connect.
#
#   router = ServerRouter()
#   server = router.add(FarServer("far", location=2))          an echo server, available at once
#   server.takes = False; server.answer = ...; router.withdraw(server); router.comeBack(server)
import itertools
import socket
import threading
import time
from collections import deque

from codec import item
from peer import Connection, Violation, bodyBytes, greeting, kFromClientRouter, mustBeCarried

kReplyBytes = 64
kMaxBindings = 4096
_lives = itertools.count(1000)


def echo(request):
  request.reply(request.message)


class FarServer:
  """answer(request) is called with `changed` held; it may keep the request and answer later."""

  def __init__(
    self, name, location, answer=echo, queueSize=100, maxOutstanding=256, maxMessageBytes=1 << 18
  ):
    self.key, self.answer = (location, name), answer
    self.queueSize, self.maxOutstanding, self.maxMessageBytes = (
      queueSize,
      maxOutstanding,
      maxMessageBytes,
    )
    self.incarnation = next(_lives)
    self.isThere = True
    self.takes = True  # whether it takes requests from its queues
    self.taken = []    # the requests that it has taken, in order


class Asked:
  """A request at the server router."""

  def __init__(self, client, body):
    self.client_ = client
    self.requestId, self.message, self.takeWithinNs = (
      body["requestId"],
      body["message"],
      body["takeWithinNs"],
    )
    self.dueAt = time.monotonic() + self.takeWithinNs / 1e9 if self.takeWithinNs else None
    self.isTaken = False
    self.hasReply_ = False

  def reply(self, message):
    """Sends a reply. The first one ends the request; others may follow."""
    envelope = {
      **message,
      "clientType": self.message["clientType"],
      "clientExtra": self.message["clientExtra"],
    }
    isFirst, self.hasReply_ = not self.hasReply_, True
    self.client_.reply(self.requestId, isFirst, envelope)

  def fail(self, fate, reason=""):
    self.client_.fate(self.requestId, fate, reason)


class SessionClient:
  def __init__(self, session, body, server):
    self.session_ = session
    self.number, self.binding = body["client"], body["binding"]
    self.server = server  # None: the client was not created
    self.window = self.wholeWindow = body["window"]
    self.leastWindow = self.window
    self.isOpen = True
    self.refusal = None   # the reason as text
    self.queueFullSent_ = False
    self.unanswered = {}  # id: Asked
    self.held = deque()   # bodies of `reply` that wait for the window

  def request(self, body):
    requestId = body["requestId"]
    if requestId == 0:
      raise Violation("protocol", "requestId 0")
    mustBeCarried(body["message"])
    asked = Asked(self, body)
    if self.server is None:
      return self.sendFate(requestId, "neverTaken", "another server or no server is there")
    if self.refusal is not None:
      return self.sendFate(requestId, "refused", self.refusal)
    reason = self.reasonAgainst(body)
    if reason:
      return self.sendFate(requestId, "refused", reason)
    if sum(not other.isTaken for other in self.unanswered.values()) >= self.server.queueSize:
      self.sendFate(requestId, "refused", "the queue is full")
      if not self.queueFullSent_:
        self.session_.connection.send(item("queueFull", self.number))
      self.queueFullSent_ = True
      return None
    self.queueFullSent_ = False
    self.unanswered[requestId] = asked
    return None

  def reasonAgainst(self, body):
    places = 1
    while places < self.server.maxOutstanding:
      places *= 2
    if body["requestId"] % places in (requestId % places for requestId in self.unanswered):
      return "its place is occupied"
    if len(self.unanswered) >= self.server.maxOutstanding:
      return "too many without an end"
    if body["message"]["kind"] in ("connect", "requestFate") or isinstance(
      body["message"]["kind"], int
    ):
      return "such a message is not a request"
    if bodyBytes(body["message"]) > self.server.maxMessageBytes:
      return "too large"
    return None

  def sendFate(self, requestId, fate, reason):
    self.session_.connection.send(
      item("fate", client=self.number, requestId=requestId, fate=fate, reason=reason)
    )

  def fate(self, requestId, fate, reason):
    del self.unanswered[requestId]
    self.sendFate(requestId, fate, reason)

  def reply(self, requestId, isFirst, envelope):
    if not self.isOpen:
      return
    body = {"client": self.number, "requestId": requestId, "isFirst": isFirst, "message": envelope}
    connection = self.session_.connection
    if bodyBytes(envelope) <= connection.theirs["maxMessageBytes"] and connection.fits(
      item("reply", body)
    ):
      self.held.append(body)
      self.sendHeld()
    elif isFirst:
      self.fate(requestId, "outcomeUnknown", "the reply is too large")

  def sendHeld(self):
    while self.held and self.window > 0:
      body = self.held.popleft()
      if body["isFirst"]:
        del self.unanswered[body["requestId"]]
      self.window -= kReplyBytes + bodyBytes(body["message"])
      self.leastWindow = min(self.leastWindow, self.window)
      self.session_.connection.send(item("reply", body))

  def credit(self, bytes_):
    self.window = min(self.window + bytes_, self.wholeWindow)
    self.sendHeld()

  def refuse(self, reason):
    """Notifies the other side; the fates end the requests."""
    self.refusal = reason
    self.session_.connection.send(item("refuse", client=self.number, reason=reason))
    for requestId in list(self.unanswered):
      self.fate(requestId, "refused", reason)

  def serverGone(self):
    for requestId, asked in list(self.unanswered.items()):
      self.fate(
        requestId, "outcomeUnknown" if asked.isTaken else "neverTaken", "the server is gone"
      )
    self.close()

  def close(self):
    self.isOpen = False
    self.held.clear()
    self.unanswered.clear()


class Session:
  """The state of one connection."""
  kTakes = kFromClientRouter

  def __init__(self, router, connected, **options):
    self.router_ = router
    self.changed = router.changed
    self.bindings = {}  # number: location and name
    self.clients = {}
    self.bound = []     # bodies of `bind`, in order
    self.unbound = []
    self.connection = Connection(connected, self, **options)
    self.connection.start()

  def onGreeting(self, body):
    pass

  def onItem(self, kind, body):
    if kind == "bind":
      self.onBind(body)
    elif kind == "unbind":
      self.unbound.append(body)
      self.bindings.pop(body, None)
      self.closeClients(body)
    elif kind == "open":
      self.onOpen(body)
    elif kind == "close":
      if body in self.clients:
        self.clients[body].close()
    else:
      client = self.clients.get(body["client"])
      if client is None:
        raise Violation("protocol", f"{kind} of a client that was never opened")
      if client.isOpen:
        client.request(body) if kind == "request" else client.credit(body["bytes"])

  def onBind(self, body):
    number = body["binding"]
    if number in self.bindings:
      raise Violation("protocol", "a binding whose number is in use")
    self.bound.append(body)
    if (
      body["location"] not in self.connection.mine["locations"]
      or len(self.bindings) >= kMaxBindings
    ):
      self.connection.send(
        item("server", binding=number, state="refused", reason="this location is not served here")
      )
      return
    self.bindings[number] = (body["location"], body["server"])
    self.sendState(number, self.router_.find(self.bindings[number]))

  def sendState(self, number, server):
    if not server or not server.isThere:
      self.connection.send(
        item("server", binding=number, state="absent", reason="the server is not running")
      )
      return
    self.connection.send(
      item(
        "server",
        binding=number,
        state="there",
        incarnation=server.incarnation,
        queueSize=server.queueSize,
        maxMessageBytes=server.maxMessageBytes,
        maxOutstanding=server.maxOutstanding,
        hops=0,
      )
    )

  def onOpen(self, body):
    if body["client"] <= max(self.clients, default=0):
      raise Violation("protocol", "a client whose number is not greater")
    if (
      sum(client.isOpen and client.server is not None for client in self.clients.values())
      >= self.connection.mine["maxClients"]
    ):
      raise Violation("limit", "too many clients")
    server = self.router_.find(self.bindings.get(body["binding"]))
    isMade = server and server.isThere and server.incarnation == body["incarnation"]
    self.clients[body["client"]] = SessionClient(self, body, server if isMade else None)

  def closeClients(self, binding):
    for client in self.clients.values():
      if client.binding == binding:
        client.close()

  def serverGone(self, server):
    for number, bound in self.bindings.items():
      if bound == server.key:
        for client in self.clients.values():
          if client.server is server and client.isOpen and client.binding == number:
            client.serverGone()
        self.sendState(number, server)

  def serverCame(self, server):
    for number, bound in self.bindings.items():
      if bound == server.key:
        self.sendState(number, server)

  def nextTime(self):
    return min((asked.dueAt for asked in self.untaken() if asked.dueAt), default=None)

  def untaken(self):
    return [
      asked
      for client in self.clients.values()
      for asked in client.unanswered.values()
      if not asked.isTaken
    ]

  def onTime(self, now):
    """The servers take the requests that wait for them, unless their deadline has passed."""
    for asked in self.untaken():
      server = asked.client_.server
      if asked.dueAt and now >= asked.dueAt:
        asked.fail("expired", "the deadline has passed")
      elif server.takes:
        asked.isTaken = True
        server.taken.append(asked)
        server.answer(asked)
        self.changed.notify_all()

  def onEnd(self):
    for client in self.clients.values():
      client.close()


class ServerRouter:
  """Options are those of Connection; `fields` go into the greeting."""

  def __init__(self, version="", spread=False, **fields):
    self.changed = threading.Condition()
    self.servers = []
    self.sessions = []
    self.options_ = {"version": version, "spread": spread}
    self.fields = fields
    self.isOpen_ = True
    self.listener_ = socket.create_server(("127.0.0.1", 0))
    self.address = self.listener_.getsockname()
    threading.Thread(target=self.accept, daemon=True).start()

  def accept(self):
    while True:
      try:
        connected, _ = self.listener_.accept()
      except OSError:
        return
      with self.changed:
        mine = greeting(locations=sorted({server.key[0] for server in self.servers}), **self.fields)
        self.sessions.append(Session(self, connected, mine=mine, **self.options_))
        self.changed.notify_all()

  def close(self):
    with self.changed:
      if self.isOpen_:
        self.isOpen_ = False
        self.listener_.shutdown(socket.SHUT_RDWR)
        self.listener_.close()
        for session in self.sessions:
          session.connection.leave()

  def add(self, server):
    with self.changed:
      self.servers.append(server)
      for session in self.sessions:
        session.serverCame(server)
    return server

  def find(self, key):
    return next((server for server in self.servers if server.key == key), None)

  def withdraw(self, server):
    with self.changed:
      server.isThere = False
      for session in self.sessions:
        session.serverGone(server)

  def comeBack(self, server):
    with self.changed:
      server.isThere, server.incarnation = True, next(_lives)
      for session in self.sessions:
        session.serverCame(server)

  def resume(self, server):
    """The server takes requests again."""
    with self.changed:
      server.takes = True
      for session in self.sessions:
        session.connection.wake()

  def await_(self, holds):
    with self.changed:
      self.changed.wait_for(holds)
