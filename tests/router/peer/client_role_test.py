# SPDX-License-Identifier: MIT
# Tests the peer as a client router with the real programs:
#   client_role_test.py FOLDER-OF-THE-PROGRAMS [arguments of unittest]
import signal
import struct

from client_role import Binding, ClientRouter
from codec import encodeFrame, item, joined
from peer import greeting
from peer_case import PeerCase, inBytes, kMessages, kSpeech, main, message
from server_role import FarServer, ServerRouter


class AsClientRouter(PeerCase):
  def setUp(self):
    super().setUp()
    self.router, self.address = self.programs.router(self.near, "--serve", 1)

  def serve(self, program="mpf-int32-server", name="echo"):
    return self.programs.start(self.near, program, name, "--location", 1)

  def opened(self, **options):
    """Connects a router, and opens a client of "echo"."""
    router = ClientRouter(self.address, **options)
    binding = router.bind(1, "echo")
    router.awaitState(binding, "there")
    return router, router.open(binding)

  def leave(self, router):
    router.connection.leave()
    self.assertEqual(router.connection.awaitEnding(), ("mine", "stopping"))

  def testSendsItsGreeting(self):
    router = ClientRouter(self.address)

    router.connection.await_(lambda: router.connection.theirs)

    theirs = router.connection.theirs
    self.assertEqual((theirs["protocolMajor"], theirs["locations"]), (1, [1]))
    self.assertNotEqual(theirs["incarnation"], 0)
    self.assertGreaterEqual(theirs["maxFrameBytes"], 65536)
    self.leave(router)

  # From `absent` to the farewell, with each version of the protocol.
  def testWholeConversation(self):
    routers = [ClientRouter(self.address, **speech) for speech in kSpeech]
    bindings = [(router.bind(1, "echo"), router.bind(1, "chars")) for router in routers]
    for router, (binding, _) in zip(routers, bindings):
      router.awaitState(binding, "absent")
    self.serve()
    self.serve("mpf-char8-array-server", "chars")

    for router, (ints, chars) in zip(routers, bindings):
      for binding in (ints, chars):
        self.assertNotEqual(router.awaitState(binding, "there")["incarnation"], 0)
      first, second, reader = router.open(ints), router.open(ints), router.open(chars, window=1024)
      asked = {
        (client, value): client.ask(message("int32", value, 8, value=value))
        for value in range(50)
        for client in (first, second)
      }
      for (_, value), one in asked.items():
        kind, reply = router.awaitEnd(one)
        self.assertEqual(
          (kind, reply["clientType"], reply["clientExtra"], reply["body"]["value"]),
          ("reply", value, 8, value),
        )
      for size in range(0, 1000, 100):  # more than the window in all
        end = router.awaitEnd(reader.ask(message("char8Array", value=bytes(size))))
        self.assertEqual(end[0], "reply", (size, end))
        self.assertEqual(end[1]["body"]["value"], bytes(size))
      for one in (*kMessages[1:], {"kind": 77, "body": None}):  # this server accepts none of them
        self.assertEqual(router.awaitEnd(first.ask(one))[:2], ("fate", "refused"))
      second.close()
      router.unbind(chars)
      router.awaitPong(2**64 - 1)
      self.assertEqual(router.awaitEnd(first.ask(kMessages[0]))[0], "reply")
      self.leave(router)

  def throughTwoRouters(self, **speech):
    """This peer as a client, two real routers on one backplane, and this peer as a server."""
    far = ServerRouter(**speech)
    server = far.add(FarServer("far", 5))
    between = self.programs.backplane("between")
    self.programs.remoteRouter(between, 5, far.address)
    # A successful call shows that the server is there for all clients.
    self.assertEqual(self.programs.called(between, "far", "int32", "--location", 5)[2], 0)
    _, address = self.programs.router(between, "--serve", 5)
    router = ClientRouter(address, **speech)
    binding = router.bind(5, "far")
    router.awaitState(binding, "there")
    return far, server, router, router.open(binding)

  # Messages arrive unchanged, including the bits of a NaN.
  def testEveryTypeOfMessageComesBackAsItWas(self):
    self.programs.stop(self.router)
    for speech in kSpeech:
      far, server, router, client = self.throughTwoRouters(**speech)

      for sent in kMessages:
        kind, reply = router.awaitEnd(client.ask(sent))

        self.assertEqual(kind, "reply")
        self.assertEqual(inBytes(server.taken[-1].message), inBytes(sent))
        self.assertEqual(inBytes(reply), inBytes(sent))
      self.leave(router)
      far.close()

  # A message without a request arrives as a further reply to request 0. `queueFull` arrives, too.
  def testReceivesMessagesWithoutARequest(self):
    self.programs.stop(self.router)
    far, _, router, client = self.throughTwoRouters()
    def answer(request):
      request.client_.reply(0, False, message("outOfBand", value=5))
      far.sessions[-1].connection.send(item("queueFull", request.client_.number))
      request.reply(request.message)
    far.servers[0].answer = answer

    router.awaitEnd(client.ask(message("int32")))

    router.connection.await_(lambda: client.queueFull == 1 and 0 in client.answered)
    self.assertEqual(
      [(one["kind"], one["body"]["value"]) for one in client.answered[0].further],
      [("outOfBand", 5)],
    )
    far.close()

  # While a server is stopped, its queue fills: further requests are refused, those with a deadline
  # expire, and the others are handled later.
  def testQueueFullAndExpiry(self):
    server = self.serve()
    router, client = self.opened()
    router.awaitEnd(client.ask(message("int32")))
    self.programs.pause(server)
    expiring = client.ask(message("int32"), takeWithinNs=1_000_000)

    self.assertEqual(router.awaitEnd(expiring)[:2], ("fate", "expired"))
    size = client.life["queueSize"]
    asked = [client.ask(message("int32", value=number)) for number in range(size + 10)]
    router.awaitPong(1)  # all of them have been read
    router.connection.await_(lambda: client.queueFull > 0)
    server.send_signal(signal.SIGCONT)

    ends = [router.awaitEnd(one)[:2] for one in asked]
    self.assertGreaterEqual(ends.count(("fate", "refused")), 10)
    self.assertGreater(sum(end[0] == "reply" for end in ends), 0)
    self.leave(router)

  def testReceivesNoMoreThanItsWindow(self):
    self.serve()
    router, client = self.opened()
    narrow = router.open(client.binding, window=65)
    narrow.givesCredit = False
    router.awaitEnd(narrow.ask(message("int32")))  # 1 byte of 65 is left, which permits one more

    asked = [narrow.ask(message("int32", value=number)) for number in range(4)]

    for taken in (2, 3, 4, 5):
      router.connection.await_(lambda: narrow.taken == taken)
      router.awaitEnd(client.ask(message("int32")))  # the other client receives its replies
      router.awaitPong(taken)
      self.assertEqual(narrow.taken, taken)
      router.connection.send(item("credit", client=narrow.number, bytes=64))
    for one in asked:
      self.assertEqual(router.awaitEnd(one)[0], "reply")
    self.leave(router)

  # All requests have ended when `absent` arrives. A restarted server is another server.
  def testServerIsKilledAndRestarted(self):
    server = self.serve()
    router, client = self.opened()
    router.awaitEnd(client.ask(message("int32")))
    self.programs.pause(server)
    asked = [client.ask(message("int32")) for _ in range(3)]
    router.awaitPong(1)

    self.programs.kill(server)

    self.assertEqual([router.awaitEnd(one)[:2] for one in asked], [("fate", "neverTaken")] * 3)
    router.awaitState(client.binding, "absent")
    old = client.life["incarnation"]
    self.serve()
    self.assertNotEqual(router.awaitState(client.binding, "there")["incarnation"], old)
    self.assertEqual(router.awaitEnd(router.open(client.binding).ask(message("int32")))[0], "reply")
    client.binding.states[-1]["incarnation"] = old
    self.assertEqual(
      router.awaitEnd(router.open(client.binding).ask(message("int32")))[:2], ("fate", "neverTaken")
    )
    self.leave(router)

  # Each violation ends the connection with the right code.
  def testViolations(self):
    self.serve()
    again = {"binding": 1, "location": 1, "server": "echo"}
    broken = struct.pack("<IIQ", 0, 1, 0xFFFFFFFFFFFFFFFF)
    for raw, code in (
      ([item("bind", again)], "protocol"),
      ([item("reply", client=1)], "protocol"),
      ([item("open", client=1, binding=1)], "protocol"),
      ([item("open", client=0, binding=1)], "protocol"),
      ([item("request", client=9, requestId=1, message=message("int32"))], "protocol"),
      ([item("credit", client=9, bytes=1)], "protocol"),
      ([item("request", client=1, requestId=0, message=message("int32"))], "protocol"),
      (
        [item("request", client=1, requestId=1, message=message("char8Array", eomString=b"12345"))],
        "protocol",
      ),
      (broken, "protocol"),
      (joined([encodeFrame([])[8:]] + [b""] * 512), "protocol"),
      (struct.pack("<II", 0, 0xFFFFFFF), "limit"),
    ):
      with self.subTest(code=code, raw=raw):
        router, _ = self.opened()
        router.connection.sendBytes(encodeFrame(raw) if isinstance(raw, list) else raw)
        self.assertEqual(router.connection.awaitEnding(), ("theirs", code))

  def testGreetingThatIsTooLong(self):
    router = ClientRouter(self.address, program="x" * 70000)
    self.assertEqual(router.connection.awaitEnding(), ("theirs", "limit"))

  def testConnectionsWithoutAGreeting(self):
    for first, code in (
      (item("ping", stamp=1), "protocol"),
      (item(99, {}), "protocol"),
      (item("none", {}), "protocol"),
      (item("greeting", greeting(maxFrameBytes=65535)), "protocol"),
    ):
      router = ClientRouter(self.address, greets=False)
      router.connection.sendBytes(encodeFrame([first]))
      self.assertEqual(router.connection.awaitEnding(), ("theirs", code))

  # A reply that exceeds our maxFrameBytes cannot be sent, and the connection continues.
  def testReplyThatExceedsTheFrameSize(self):
    self.serve("mpf-char8-array-server")
    router, client = self.opened(maxFrameBytes=65536)

    asked = client.ask(message("char8Array", value=bytes(65500)), careful=False)

    self.assertEqual(router.awaitEnd(asked)[:2], ("fate", "outcomeUnknown"))
    self.assertEqual(router.awaitEnd(client.ask(message("char8Array", value=b"1")))[0], "reply")
    self.leave(router)

  # Messages up to the announced limit can be sent; the reason of a refusal names the limit.
  def testMessagesUpToTheLimit(self):
    self.programs.stop(self.router)
    self.router, self.address = self.programs.router(
      self.near, "--serve", 1, "--max-message-size", 1000
    )
    self.serve("mpf-char8-array-server")
    router, client = self.opened()
    self.assertEqual(
      (client.life["maxMessageBytes"], router.connection.theirs["maxMessageBytes"]), (1000, 1000)
    )

    self.assertEqual(
      router.awaitEnd(client.ask(message("char8Array", value=bytes(1000))))[0], "reply"
    )
    end = router.awaitEnd(client.ask(message("char8Array", value=bytes(1001)), careful=False))

    self.assertEqual(end[:2], ("fate", "refused"))
    self.assertIn("1001 bytes, the limit is 1000", end[2])
    self.leave(router)

  def testSilenceEndsTheConnection(self):
    self.programs.stop(self.router)
    self.router, self.address = self.programs.router(
      self.near, "--serve", 1, "--dead-time", "200ms"
    )
    router = ClientRouter(self.address)
    router.connection.answersPings = False
    self.assertEqual(router.connection.awaitEnding(), ("theirs", "silence"))

  # The remaining replies of a killed server respect the window; beyond it only the fates are sent.
  def testRepliesOfAKilledServerRespectTheWindow(self):
    server = self.serve()
    router, client = self.opened()
    narrow = router.open(client.binding, window=65)
    narrow.givesCredit = False
    asked = [narrow.ask(message("int32", value=number)) for number in range(5)]
    self.assertEqual([router.awaitEnd(one)[0] for one in asked[:2]], ["reply"] * 2)
    # Clients take turns at the server: after as many requests of another one, it has answered all.
    for _ in asked:
      router.awaitEnd(client.ask(message("int32")))

    self.programs.kill(server)

    self.assertEqual(
      [router.awaitEnd(one)[:2] for one in asked[2:]], [("fate", "outcomeUnknown")] * 3
    )
    self.leave(router)

  # Items that were sent before a change arrived, and unknown items of a newer peer, are ignored.
  def testLateAndUnknownItemsAreIgnored(self):
    self.serve()
    router, client = self.opened()
    gone = router.open(client.binding)
    gone.close()
    stray = Binding(77, 1, "echo")  # it was never sent to the router
    stray.states = client.binding.states

    router.connection.send(
      item("unbind", 77),
      item("close", 77),
      item("close", gone.number),
      item("credit", client=gone.number, bytes=1),
      item("request", client=gone.number, requestId=1, message=message("int32")),
      item(99, {}),
      item("none", {}),
      item("greeting", greeting(protocolMajor=7)),
    )
    never = router.open(stray).ask(message("int32"))

    self.assertEqual(router.awaitEnd(client.ask(message("int32")))[0], "reply")
    self.assertEqual(router.awaitEnd(never), ("fate", "neverTaken", never.end[2]))
    self.leave(router)

  def testOtherMajorVersionIsRefused(self):
    for major in (0, 2):
      router = ClientRouter(self.address, version="newer", protocolMajor=major)
      self.assertEqual(router.connection.awaitEnding(), ("theirs", "version"))

  def testRouterSendsAFarewell(self):
    router = ClientRouter(self.address)
    router.connection.await_(lambda: router.connection.theirs)
    self.programs.stop(self.router)
    self.assertEqual(router.connection.awaitEnding(), ("theirs", "stopping"))


if __name__ == "__main__":
  main()
