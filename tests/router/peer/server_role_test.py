# SPDX-License-Identifier: MIT
# Tests the peer as a server router with the real programs:
#   server_role_test.py FOLDER-OF-THE-PROGRAMS [arguments of unittest]
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
    """Starts this peer with a server "far" at location 2, and a real router that connects to it."""
    far = ServerRouter(**speech)
    server = far.add(
      FarServer("far", 2, maxMessageBytes=min(far.fields.get("maxMessageBytes", 1 << 18), 1 << 18))
    )
    self.real = self.programs.remoteRouter(self.near, 2, far.address, *options)
    return far, server

  def again(self, options=(), **speech):
    """Starts such a pair on another backplane; `options` are for the real router."""
    self.programs.stop(self.real)
    self.far.close()
    self.near = self.programs.backplane("near")
    self.far, self.server = self.connected(options, **speech)

  def replies(self, *arguments):
    out, error, status = self.programs.called(self.near, "far", *arguments, "--location", 2)
    self.assertEqual(status, 0, error)
    return out["replies"]

  def follow(self, *arguments, **options):
    """Starts a client that prints replies until it is stopped."""
    return self.programs.start(
      self.near,
      "mpf",
      "call",
      "far",
      *arguments,
      "--location",
      2,
      "--timeout",
      600,
      "--follow",
      600,
      "--print",
      **{"stdout": subprocess.PIPE, **options},
    )

  def session(self):
    self.far.await_(lambda: self.far.sessions)
    return self.far.sessions[-1]

  def testEchoesEveryTypeOfMessage(self):
    for speech in kSpeech:
      self.again(**speech)
      for kind, value in (
        ("int32", "7"),
        ("int32Array", "1,-2"),
        ("float64", "0.5"),
        ("float64Array", "0.5,nan"),
        ("char8Array", "abc"),
        ("outOfBand", "3"),
        ("user", "0011"),
      ):
        self.assertEqual(self.replies(kind, f"value={value}")[0]["type"], kind)
      self.assertEqual(self.replies("serialConfig", "baud=9600")[0]["baud"], 9600)
      self.assertEqual(
        [request.message["kind"] for request in self.server.taken[-2:]], ["user", "serialConfig"]
      )

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
    for fate, said in (
      ("refused",) * 2,
      ("neverTaken",) * 2,
      ("expired",) * 2,
      ("outcomeUnknown",) * 2,
      (17, "outcomeUnknown"),
    ):
      self.server.answer = lambda request: request.fail(fate, "chosen by the test")
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

  # A message that is too large for a peer is refused on this host, with an error that names the
  # limit.
  def testLimitsAreNamed(self):
    for fields, limit in (({"maxMessageBytes": 1000}, 1000), ({"maxFrameBytes": 65536}, 64512)):
      self.again(**fields)
      out, error, status = self.programs.called(
        self.near, "far", "char8Array", f"value={'x' * (limit + 1)}", "--location", 2
      )
      self.assertEqual(status, 1)
      self.assertRegex(next(iter(out["why"])), f"not sent: .*: [0-9]+ bytes, the limit is {limit}$")
      self.assertEqual(self.server.taken, [])
      self.replies("int32")

  # maxMessageBytes counts elements, and an int32 has no elements.
  def testNoMessageIsTooLargeWithoutAnArray(self):
    self.again(maxMessageBytes=0)
    for kind in ("int32", "float64", "serialConfig", "char8Array", "user"):
      self.replies(kind)

  def testNoMoreClientsThanThePeerAccepts(self):
    self.again(maxClients=1)
    self.server.takes = False
    first = self.programs.call(self.near, "far", "int32", "--location", 2)
    self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))

    second = self.programs.call(self.near, "far", "int32", "--location", 2)

    self.assertIn("no reply: refused", second.communicate()[1])
    self.far.resume(self.server)
    self.assertEqual(first.wait(), 0)
    self.assertIsNone(self.session().connection.ending)

  def testReplyToAnUnknownClient(self):
    self.replies("int32")
    session = self.session()

    session.connection.send(item("reply", client=9, isFirst=True, message=message("int32")))

    self.assertEqual(session.connection.awaitEnding(), ("theirs", "protocol"))

  # A request that is sent before `absent` arrives was never taken; after any other new state its
  # outcome is unknown.
  def testRequestThatCrossedTheEndOfItsServer(self):
    for state, fate in (
      ("absent", "neverTaken"),
      ("refused", "outcomeUnknown"),
      (9, "outcomeUnknown"),
    ):
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

  # The replies to a stopped client stop at its window, and continue when the client continues.
  def testRespectsCredits(self):
    size, window = 2000, 4096
    self.again(options=("--window-size", window))
    count = (
      2 * self.server.maxOutstanding + window // size
    )  # more than its queue and the window hold
    self.server.takes = False
    def answer(request):
      for _ in range(count):
        request.reply(message("char8Array", value=bytes(size)))
    self.server.answer = answer
    client = self.follow("int32", stdout=subprocess.DEVNULL)
    self.far.await_(lambda: any(session.untaken() for session in self.far.sessions))
    self.programs.pause(client)

    self.far.resume(self.server)

    (one,) = self.session().clients.values()
    self.far.await_(lambda: one.held and one.window <= 0)
    self.assertGreater(one.leastWindow, -(size + 64))
    client.send_signal(signal.SIGCONT)
    self.far.await_(lambda: not one.held)
    self.far.await_(lambda: one.window > one.wholeWindow * 3 // 4 - size - 64)
    self.assertGreater(one.leastWindow, -(size + 64))

  # A request carries its deadline, and expires when the server does not take it in time.
  def testExpires(self):
    self.server.takes = False
    self.far.await_(lambda: self.far.sessions)
    error = ""
    while not self.session().connection.counts[
      "request"
    ]:  # the deadline may pass before the request reaches the router
      call = self.programs.start(
        self.near,
        "mpf",
        "call",
        "far",
        "int32",
        "--location",
        2,
        "--timeout",
        0.2,
        stderr=subprocess.PIPE,
      )
      error = call.communicate()[1]

    self.assertRegex(error, "expired|outcomeUnknown")  # the client may notice the deadline first
    self.far.await_(lambda: not self.session().untaken())

  def testMajorTwoIsRefusedAndTriedAgain(self):
    self.far.fields = {"protocolMajor": 2}
    self.session().connection.leave()

    self.far.await_(lambda: len(self.far.sessions) >= 3)

    for session in self.far.sessions[1:2]:
      self.assertEqual(session.connection.awaitEnding(), ("theirs", "version"))

  def testRouterSendsAFarewell(self):
    self.replies("int32")
    self.programs.stop(self.real)
    self.assertEqual(self.session().connection.awaitEnding(), ("theirs", "stopping"))


if __name__ == "__main__":
  main()
