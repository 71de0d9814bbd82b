# SPDX-License-Identifier: MIT
# The peer as a client router: connects, binds to servers, opens clients, and sends their requests.
#
#   router = ClientRouter((host, port))
#   binding = router.bind(1, "Int32"); router.awaitState(binding, "there")
#   client = router.open(binding)
#   asked = client.ask(message); router.awaitEnd(asked)
#   asked.end   ("reply", message) or ("fate", name of the fate, reason)
import socket
import threading

from codec import item
from peer import Connection, Violation, bodyBytes, greeting, kFromServerRouter, mustBeCarried

kReplyBytes = 64  # bytes that a reply takes from the window besides its body


class Binding:
  def __init__(self, number, location, server):
    self.number, self.location, self.server = number, location, server
    self.states = []  # bodies of the `server` items, in order
    self.isClosed = False

  def state(self):
    return self.states[-1]["state"] if self.states else None


class Asked:
  """A request: its `end`, or None while it is pending, and its further replies."""

  def __init__(self, requestId, wasWritten):
    self.requestId = requestId
    self.wasWritten = wasWritten
    self.end = None
    self.further = []


class Client:
  def __init__(self, router, number, binding, window):
    self.router_ = router
    self.number, self.binding, self.window = number, binding, window
    self.life = binding.states[-1]
    self.isOpen = True
    self.isRefused = False
    self.givesCredit = True
    self.uncredited = 0  # bytes of received replies for which no credit has been sent
    self.taken = 0       # received replies
    self.queueFull = 0   # received `queueFull` items
    self.unanswered = {}  # id: Asked
    self.answered = {}
    self.lastId_ = 0

  def ask(self, message, takeWithinNs=0, requestId=None, careful=True):
    """Sends a request. If not `careful`, sends it even when the protocol forbids it."""
    with self.router_.changed:
      asked = Asked(requestId or self.nextId(), wasWritten=True)
      one = item(
        "request",
        client=self.number,
        requestId=asked.requestId,
        takeWithinNs=takeWithinNs,
        message=message,
      )
      refusal = careful and self.refusal(message, one)
      if refusal:
        asked.wasWritten, asked.end = False, ("fate", refusal, "by this side")
      else:
        self.unanswered[asked.requestId] = asked
        self.router_.connection.send(one)
      return asked

  def refusal(self, message, one):
    if not self.isOpen:
      return "neverTaken"
    tooLarge = bodyBytes(message) > min(
      self.life["maxMessageBytes"], self.router_.connection.theirs["maxMessageBytes"]
    )
    if (
      self.isRefused
      or tooLarge
      or len(self.unanswered) >= self.life["maxOutstanding"]
      or not self.router_.connection.fits(one)
    ):
      return "refused"
    return None

  def nextId(self):
    places = 1
    while places < self.life["maxOutstanding"]:
      places *= 2
    occupied = {requestId % places for requestId in self.unanswered}
    while True:
      self.lastId_ = self.lastId_ % 0xFFFFFFFF + 1
      if self.lastId_ % places not in occupied or len(occupied) == places:
        return self.lastId_

  def onReply(self, body):
    message, requestId = body["message"], body["requestId"]
    mustBeCarried(message)
    isKnown = isinstance(message["kind"], str)
    asked = self.unanswered.get(requestId)
    if message["kind"] in ("connect", "requestFate"):
      raise Violation("protocol", f"a reply that is a {message['kind']}")
    if body["isFirst"] != (asked is not None):
      raise Violation(
        "protocol",
        "a first reply to nothing" if body["isFirst"] else "a further reply before the first",
      )
    if asked:
      self.finish(
        requestId,
        ("reply", message)
        if isKnown
        else ("fate", "outcomeUnknown", "a reply of a kind that is not known here"),
      )
    elif isKnown:
      self.answered.setdefault(requestId, Asked(requestId, False)).further.append(message)
    self.taken += 1
    self.uncredited += (
      kReplyBytes + bodyBytes(message) if isKnown else self.window
    )  # a window never grows beyond its size in `open`
    self.sendCredit()

  def sendCredit(self):
    if self.givesCredit and self.uncredited * 4 > self.window:
      self.router_.connection.send(
        item("credit", client=self.number, bytes=min(self.uncredited, 0xFFFFFFFF))
      )
      self.uncredited = 0

  def finish(self, requestId, end):
    asked = self.unanswered.pop(requestId)
    asked.end = end
    self.answered[requestId] = asked

  def finishAll(self, fate, reason):
    for requestId in list(self.unanswered):
      self.finish(requestId, ("fate", fate, reason))

  def close(self):
    with self.router_.changed:
      self.isOpen = False
      self.router_.connection.send(item("close", self.number))


class ClientRouter:
  kTakes = kFromServerRouter

  def __init__(self, address, version="", spread=False, greets=True, **fields):
    self.changed = threading.Condition()
    self.bindings = {}
    self.clients = {}
    self.connection = Connection(
      socket.create_connection(address),
      self,
      greeting(**fields) if greets else None,
      version,
      spread,
    )
    self.connection.start()

  # ---- actions

  def bind(self, location, server):
    with self.changed:
      binding = Binding(len(self.bindings) + 1, location, server)
      self.bindings[binding.number] = binding
      self.connection.send(item("bind", binding=binding.number, location=location, server=server))
      return binding

  def unbind(self, binding):
    with self.changed:
      self.closeBinding(binding, "outcomeUnknown", "unbound")
      binding.isClosed = True
      self.connection.send(item("unbind", binding.number))

  def open(self, binding, window=65536):
    with self.changed:
      client = Client(self, len(self.clients) + 1, binding, window)
      self.clients[client.number] = client
      life = binding.states[-1]["incarnation"]
      self.connection.send(
        item("open", client=client.number, binding=binding.number, incarnation=life, window=window)
      )
      return client

  def awaitState(self, binding, state):
    self.connection.await_(lambda: binding.state() == state)
    return binding.states[-1]

  def awaitEnd(self, asked):
    self.connection.await_(lambda: asked.end, afterEnd=True)
    return asked.end

  def awaitPong(self, stamp):
    """Waits until all earlier items have been read and immediate answers have arrived."""
    self.connection.send(item("ping", stamp=stamp))
    self.connection.await_(lambda: stamp in self.connection.stamps)

  # ---- received items

  def onGreeting(self, body):
    pass

  def onItem(self, kind, body):
    if kind == "server":
      self.onServer(body)
      return
    client = self.clients.get(body if kind == "queueFull" else body["client"])
    if client is None:
      raise Violation("protocol", f"{kind} for a client that was never opened")
    if not client.isOpen:
      return
    if kind == "reply":
      client.onReply(body)
    elif kind == "fate" and body["requestId"] in client.unanswered:
      fate = (
        body["fate"]
        if body["fate"] in ("refused", "neverTaken", "expired", "outcomeUnknown")
        else "outcomeUnknown"
      )
      client.finish(body["requestId"], ("fate", fate, body["reason"]))
    elif kind == "queueFull":
      client.queueFull += 1
    elif kind == "refuse":
      client.isRefused = True  # a notification; the fates of its requests follow

  def onServer(self, body):
    binding = self.bindings.get(body["binding"])
    if binding is None or binding.isClosed:
      return
    binding.states.append(body)
    if isinstance(body["state"], int):
      body["state"] = "absent"
    if body["state"] == "absent":
      self.closeBinding(binding, "neverTaken", "the server is gone")
    elif body["state"] == "refused":
      binding.isClosed = True
      self.closeBinding(binding, "outcomeUnknown", body["reason"])

  def closeBinding(self, binding, fate, reason):
    for client in self.clients.values():
      if client.binding is binding and client.isOpen:
        client.isOpen = False
        client.finishAll(fate, reason)

  def nextTime(self):
    return None

  def onTime(self, now):
    pass

  def onEnd(self):
    for client in self.clients.values():
      client.isOpen = False
      client.finishAll("outcomeUnknown", "the connection has ended")
