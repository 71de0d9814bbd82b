# SPDX-License-Identifier: MIT
# The peer as a server router of a real one: server_role_test.py FOLDER-OF-THE-PROGRAMS [arguments of unittest]
import signal
import subprocess

from codec import item
from peer_case import PeerCase, kSpeech, main, message
from server_role import FarServer, ServerRouter


class AsServerRouter(PeerCase):
  def setUp(self):
    super().setUp()
    self.far, self.server = self.connected()

  def tearDown(self):
    self.far.close()
    super().tearDown()

  def connected(self, options=(), **speech):
    """This peer with a server, "far" at location 2, and a real router on self.near that connects to it."""
    far = ServerRouter(**speech)
    server = far.add(FarServer("far", 2, maxMessageBytes=min(far.fields.get("maxMessageBytes", 1 << 18), 1 << 18)))
    self.real = self.programs.remoteRouter(self.near, 2, far.address, *options)
    return far, server

  def again(self, options=(), **speech):
    """Another such pair, on another backplane; `options` are the real router's."""
    self.programs.stop(self.real)
    self.far.close()
    self.near = self.programs.backplane("near")
    self.far, self.server = self.connected(options, **speech)

  def replies(self, *arguments):
    out, error, status = self.programs.called(self.near, "far", *arguments, "--location", 2)
    self.assertEqual(status, 0, error)
    return out["replies"]

  def follow(self, *arguments, **options):
    """A client that stays; its lines are those that it has printed."""
    return self.programs.start(self.near, "mpf", "call", "far", *arguments, "--location", 2, "--timeout", 600, "--follow", 600, "--print",
                               **{"stdout": subprocess.PIPE, **options})

  def session(self):
    self.far.await_(lambda: self.far.sessions)
    return self.far.sessions[-1]

  def testEchoesEveryTypeOfMessage(self):
    for speech in kSpeech:
      self.again(**speech)
      for kind, value in (("int32", "7"), ("int32Array", "1,-2"), ("float64", "0.5"), ("float64Array", "0.5,nan"), ("char8Array", "abc"),
                          ("outOfBand", "3"), ("user", "0011")):
        self.assertEqual(self.replies(kind, f"value={value}")[0]["type"], kind)
      self.assertEqual(self.replies("serialConfig", "baud=9600")[0]["baud"], 9600)
      self.assertEqual([request.message["kind"] for request in self.server.taken[-2:]], ["user", "serialConfig"])

  def testSeveralRepliesToOneRequest(self):
    def answer(request):
      for value in (1, 2, 3):
        request.reply(message("int32", value=value))
    self.server.answer = answer

    client = self.follow("int32")

    lines = []
    while len(lines) < 3:
      lines += [line for line in [client.stdout.readline().strip()] if line]
    self.assertEqual([line.rsplit("=", 1)[1] for line in lines], ["1", "2", "3"])

  def testFates(self):
    for fate, said in (("refused",) * 2, ("neverTaken",) * 2, ("expired",) * 2, ("outcomeUnknown",) * 2, (17, "outcomeUnknown")):
      self.server.answer = lambda request: request.fail(fate, "as the test has it")
      out, _, status = self.programs.called(self.near, "far", "int32", "--location", 2)
      self.assertEqual(status, 1)
      self.assertIn(f"no reply: {said}", next(iter(out["why"])))

  def testReplyOfALaterVersionEndsAsUnknown(self):
    self.server.answer = lambda request: request.reply({"kind": 77, "body": None})
    out, _, _ = self.programs.called(self.near, "far", "int32", "--location", 2)
    self.assertIn("no reply: outcomeUnknown", next(iter(out["why"])))

  def testRefusesAClient(self):
    self.server.answer = lambda request: request.client_.refuse("no room")
    out, _, _ = self.programs.called(self.near, "far", "int32", "--location", 2)
    self.assertIn("no reply: refused", next(iter(out["why"])))

  # A message that is too large for a peer does not leave this host, and who sends it is told the limit.
  def testLimitsAreNamed(self):
    for fields, limit in (({"maxMessageBytes": 1000}, 1000), ({"maxFrameBytes": 65536}, 64512)):
      self.again(**fields)
      out, error, status = self.programs.called(self.near, "far", "char8Array", f"value={'x' * (limit + 1)}", "--location", 2)
      self.assertEqual(status, 1)
      self.assertRegex(next(iter(out["why"])), f"not sent: .*: [0-9]+ bytes, the limit is {limit}$")
      self.assertEqual(self.server.taken, [])
      self.replies("int32")

  # maxMessageBytes is about elements: there are none in an int32.
  def testNoMessageIsTooLargeWithoutAnArray(self):
    self.again(maxMessageBytes=0)
    for kind in ("int32", "float64", "serialConfig", "char8Array", "user"):
      self.replies(kind)

  def testNoMoreClientsThanThePeerTakes(self):
    self.again(maxClients=1)
    self.server.takes = False
    first = self.programs.call(self.near, "far", "int32", "--location", 2)
    self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))

    second = self.programs.call(self.near, "far", "int32", "--location", 2)

    self.assertIn("no reply: refused", second.communicate()[1])
    self.far.resume(self.server)
    self.assertEqual(first.wait(), 0)
    self.assertIsNone(self.session().connection.ending)

  def testReplyToNobody(self):
    self.replies("int32")
    session = self.session()

    session.connection.send(item("reply", client=9, isFirst=True, message=message("int32")))

    self.assertEqual(session.connection.awaitEnding(), ("theirs", "protocol"))

  # What crossed the news that the server is gone was never taken; of what the peer does not serve any more nothing is known.
  def testRequestThatCrossedTheEndOfItsServer(self):
    for state, fate in (("absent", "neverTaken"), ("refused", "outcomeUnknown"), (9, "outcomeUnknown")):
      self.again()
      self.server.takes = False
      call = self.programs.call(self.near, "far", "int32", "--location", 2)
      self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))

      self.session().connection.send(item("server", binding=1, state=state))

      self.assertIn(f"no reply: {fate}", call.communicate()[1])

  def testAbsentAndThereAgain(self):
    self.assertEqual(self.replies("int32", "value=1")[0]["value"], 1)
    self.server.takes = False
    call = self.programs.call(self.near, "far", "int32", "--location", 2)
    self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))

    self.far.withdraw(self.server)

    self.assertIn("neverTaken", call.communicate()[1])
    call = self.programs.call(self.near, "far", "int32", "value=2", "--location", 2)
    self.far.comeBack(self.server)
    self.far.resume(self.server)
    self.assertIn("value=2", call.communicate()[0])

  # A client that stands still stops the server's replies at the window; when it goes on, so do they.
  def testRespectsCredits(self):
    size, window = 2000, 4096
    self.again(options=("--window-size", window))
    count = 2 * self.server.maxOutstanding + window // size  # more than its queue and the window hold
    self.server.takes = False
    def answer(request):
      for _ in range(count):
        request.reply(message("char8Array", value=bytes(size)))
    self.server.answer = answer
    client = self.follow("int32", stdout=subprocess.DEVNULL)
    self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))
    client.send_signal(signal.SIGSTOP)

    self.far.resume(self.server)

    (one,) = self.session().clients.values()
    self.far.await_(lambda: one.held and one.window <= 0)
    self.assertGreater(one.leastWindow, -(size + 64))
    client.send_signal(signal.SIGCONT)
    self.far.await_(lambda: not one.held)
    self.far.await_(lambda: one.window > one.wholeWindow * 3 // 4 - size - 64)
    self.assertGreater(one.leastWindow, -(size + 64))

  # Its time goes with the request; a server that does not take it in time lets it expire.
  def testExpires(self):
    self.server.takes = False
    self.far.await_(lambda: self.far.sessions)
    error = ""
    while not self.session().connection.counts["request"]:  # the time of a call may end on the way to the router
      call = self.programs.start(self.near, "mpf", "call", "far", "int32", "--location", 2, "--timeout", 0.2, stderr=subprocess.PIPE)
      error = call.communicate()[1]

    self.assertRegex(error, "expired|outcomeUnknown")  # the client's own clock may be first
    self.far.await_(lambda: not self.session().untaken())

  def testMajorTwoIsSentAwayAndTriedAgain(self):
    self.far.fields = {"protocolMajor": 2}
    self.session().connection.leave()

    self.far.await_(lambda: len(self.far.sessions) >= 3)

    for session in self.far.sessions[1:2]:
      self.assertEqual(session.connection.awaitEnding(), ("theirs", "version"))

  def testRouterSaysFarewell(self):
    self.replies("int32")
    self.programs.stop(self.real)
    self.assertEqual(self.session().connection.awaitEnding(), ("theirs", "stopping"))


if __name__ == "__main__":
  main()
