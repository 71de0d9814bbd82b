# SPDX-License-Identifier: MIT
# Connects the two roles of the peer with each other, without a program: both must implement the
# same protocol.
import unittest

from client_role import ClientRouter
from codec import encodeFrame, item
from peer_case import inBytes, kMessages, kSpeech, kWatchdogSeconds, message
from programs import Programs
from server_role import FarServer, ServerRouter


class Alone(unittest.TestCase):
  def setUp(self):
    self.watchdog = Programs("").watchdog(kWatchdogSeconds)

  def tearDown(self):
    self.watchdog.cancel()
    self.server.close()

  def joined(self, near=None, far=None, window=65536, **options):
    """Connects both roles, and returns a client of "far"."""
    self.server = ServerRouter(**(far or {}))
    self.far = self.server.add(FarServer("far", 1, **options))
    self.near = ClientRouter(self.server.address, **(near or {}))
    binding = self.near.bind(1, "far")
    self.near.awaitState(binding, "there")
    return self.near.open(binding, window)

  def end(self, *arguments, **options):
    return self.near.awaitEnd(self.client.ask(*arguments, **options))

  def testEveryTypeOfMessageComesBackAsItWas(self):
    for near in kSpeech:
      for far in kSpeech:
        self.client = self.joined(near, far, window=100)
        for sent in kMessages:
          self.assertEqual(inBytes(self.end(sent)[1]), inBytes(sent))
        self.assertEqual(self.end({"kind": 77, "body": None})[:2], ("fate", "refused"))
        self.server.close()

  def testFullQueueExpiryAndAbsence(self):
    self.client = client = self.joined(queueSize=3, maxOutstanding=6)
    self.far.takes = False
    asked = [client.ask(message("int32")) for _ in range(5)]
    self.assertEqual([self.near.awaitEnd(one)[:2] for one in asked[3:]], [("fate", "refused")] * 2)
    self.assertEqual(client.queueFull, 1)

    self.server.withdraw(self.far)

    self.near.awaitState(client.binding, "absent")
    self.assertEqual([one.end[:2] for one in asked[:3]], [("fate", "neverTaken")] * 3)
    self.server.comeBack(self.far)
    self.near.awaitState(client.binding, "there")
    self.client = self.near.open(client.binding)
    self.assertEqual(self.end(message("int32"), takeWithinNs=1)[:2], ("fate", "expired"))

  def testAbsentAndRefusedServers(self):
    self.client = self.joined()
    absent, refused = self.near.bind(1, "other"), self.near.bind(2, "far")
    self.near.awaitState(refused, "refused")
    self.near.awaitState(absent, "absent")
    self.server.add(FarServer("other", 1))
    self.near.awaitState(absent, "there")

  def testRequestsOfARefusedClientAreRefused(self):
    self.client = client = self.joined(answer=lambda request: request.client_.refuse("no room"))
    asked = client.ask(message("int32"))
    self.near.awaitEnd(asked)
    self.assertEqual(asked.end[:2], ("fate", "refused"))
    self.assertEqual(self.end(message("int32"), careful=False)[:2], ("fate", "refused"))

  def testMessagesThatAreTooLargeEndLocally(self):
    self.client = self.joined(maxMessageBytes=1000)
    self.assertEqual(self.end(message("char8Array", value=bytes(1001)))[2], "by this side")
    self.assertEqual(
      self.end(message("char8Array", value=bytes(1001)), careful=False)[1], "refused"
    )
    self.far.answer = lambda request: request.reply(message("user", value=bytes(1 << 20)))
    self.assertEqual(
      self.end(message("int32")), ("fate", "outcomeUnknown", "the reply is too large")
    )

  def testWindowLimitsReplies(self):
    self.client = client = self.joined(window=128)
    client.givesCredit = False
    asked = [client.ask(message("int32")) for _ in range(4)]
    self.near.connection.await_(lambda: client.taken == 2)
    self.near.awaitPong(1)
    self.assertEqual(client.taken, 2)

    client.givesCredit = True
    client.sendCredit()

    self.assertEqual([self.near.awaitEnd(one)[0] for one in asked], ["reply"] * 4)

  # Each violation is answered with a farewell of the right code.
  def testFarewells(self):
    for near, far, code in (
      ({"protocolMajor": 2, "version": "newer"}, {}, "version"),
      ({"maxFrameBytes": 65535}, {}, "protocol"),
    ):
      self.server = ServerRouter(**far)
      router = ClientRouter(self.server.address, **near)
      self.assertEqual(router.connection.awaitEnding(), ("theirs", code))
      self.server.close()
    for raw, code in (
      ([item("reply", {})], "protocol"),
      ([item("open", client=1)], "protocol"),
      ([item("credit", client=7)], "protocol"),
      ([item("open", client=0)], "protocol"),
      ([item("request", client=1, message=message("int32"))], "protocol"),
      ([item("bind", binding=1, location=1, server="far")], "protocol"),
      (b"\0\0\0\0\xff\xff\xff\xff", "limit"),
      (b"\0\0\0\0\1\0\0\0" + b"\xff" * 8, "protocol"),
    ):
      self.client = self.joined()
      self.near.connection.sendBytes(encodeFrame(raw) if isinstance(raw, list) else raw)
      self.assertEqual(self.near.connection.awaitEnding(), ("theirs", code))
      self.server.close()

  def testSilenceEndsTheConnection(self):
    self.server = ServerRouter(deadTimeMs=200)
    router = ClientRouter(self.server.address)
    router.connection.answersPings = False
    self.assertEqual(router.connection.awaitEnding(), ("theirs", "silence"))


if __name__ == "__main__":
  unittest.main()
