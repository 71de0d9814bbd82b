# SPDX-License-Identifier: MIT
# Compares the codec and its frozen layouts with today's schemas, the `capnp` tool and the examples
# of docs/wire-format.md, and reads damaged frames.
import math
import os
import random
import re
import shutil
import struct
import subprocess
import unittest

from codec import FrameReader, NoFrame, TooLong, decodeFrame, encodeFrame, item, joined
from layouts import kEnums, kLayouts, kNewerLayouts
from peer_case import message

kSources = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..")
kImports = "-I/usr/include"
kTypes = {
  "Void": "void",
  "Bool": "bool",
  "UInt8": "u8",
  "UInt16": "u16",
  "UInt32": "u32",
  "UInt64": "u64",
  "Int32": "i32",
  "Int64": "i64",
  "Float64": "f64",
  "Text": "text",
  "Data": "data",
  "List(Int32)": "[i32]",
  "List(Float64)": "[f64]",
  "List(Item)": "[Item]",
}


def kindsOfItems():
  standard = {"timeout": -1, "cmd": 2, "status": -(2**31), "address": 2**31 - 1, "extra": 5}
  messages = [
    message("connect", status="connectRefused", incarnation=2**64 - 1),
    message("int32", -5, 6, **standard, value=-7),
    message("int32Array", **standard, value=[1, -2, 3]),
    message("float64", **standard, value=-0.125),
    message("float64Array", **standard, value=[1e300, -0.0]),
    message("serialConfig", baud=9600, parity=ord("E"), flowControl=255),
    message(
      "char8Array", **standard, numberRetrys=3, eomLen=2, eomString=b"\r\n", value=bytes(range(256))
    ),
    message("outOfBand", **standard, value=9),
    message("requestFate", fate="expired", requestId=8),
    message("user", value=b"\0" * 17),
  ]
  return [
    item("none", {}),
    item(
      "greeting",
      protocolMajor=1,
      protocolMinor=2,
      router="r\u00f6uter",
      program="p",
      incarnation=3,
      locations=[-1, 0, 7],
      maxFrameBytes=4,
      maxMessageBytes=5,
      deadTimeMs=6,
      maxClients=7,
    ),
    item("farewell", reason="why", code="notAllowed"),
    item("ping", stamp=2**63),
    item("pong", stamp=1),
    item("bind", binding=1, location=-2, server="Int32"),
    item("unbind", 2**32 - 1),
    item(
      "server",
      binding=1,
      state="there",
      incarnation=2,
      queueSize=3,
      maxMessageBytes=4,
      reason="",
      maxOutstanding=5,
      hops=6,
    ),
    item("open", client=1, binding=2, incarnation=3, window=4),
    item("close", 5),
    item("refuse", client=6, reason="no room"),
    *(item("request", client=1, requestId=2, takeWithinNs=3, message=m) for m in messages),
    *(item("reply", client=1, requestId=2, isFirst=True, message=m) for m in messages),
    item("fate", client=1, requestId=2, fate="outcomeUnknown", reason="gone"),
    item("queueFull", 1),
    item("credit", client=1, bytes=2),
  ]


def decoded(frame):
  reader = FrameReader(1 << 20)
  reader.feed(frame)
  return decodeFrame(reader.tryNext())


def covers(value, sent):
  """Whether all sent fields have been read; fields that were not sent have their default values."""
  if isinstance(sent, dict):
    return all(covers(value.get(key) if value else None, sent[key]) for key in sent)
  return value == sent


@unittest.skipUnless(shutil.which("capnp"), "the tool `capnp` is not installed")
class Tool(unittest.TestCase):
  def capnp(self, *arguments, given=b""):
    done = subprocess.run(
      ["capnp", *arguments], input=given, capture_output=True, cwd=kSources, check=False
    )
    self.assertEqual(done.returncode, 0, done.stderr.decode())
    return done.stdout

  # Each field of the table has the same place in today's schemas. Enums and unions begin with the
  # values and members of the table.
  def testSchemasHaveTheFrozenLayouts(self):
    compiled = self.capnp(
      "compile", kImports, "-ocapnp", "schema/router.capnp", "schema/message.capnp"
    ).decode()
    found, structName, enumName = {}, None, None
    for line in compiled.splitlines():
      if match := re.match(r"struct (\w+) .*# (\d+) bytes, (\d+) ptrs", line):
        structName, enumName = match[1], None
        found[structName] = (int(match[2]) // 8, int(match[3]))
      elif match := re.match(r"\s*enum (\w+)", line):
        enumName = match[1]
      elif match := re.search(r"union \{ *# tag bits \[(\d+),", line):
        found[structName, "tag"] = int(match[1]) // 8
      elif match := re.match(
        r"\s*(\w+) @(\d+) :(.*);  # (ptr|bits)\[(\d+).*?(?:union tag = (\d+))?$", line
      ):
        place = int(match[5]) if match[4] == "ptr" else int(match[5]) // 8
        found[structName, match[1]] = (match[3].split(".")[-1], place, match[6])
      elif match := re.match(r"\s*(\w+) @(\d+);", line):
        found[enumName, int(match[2])] = match[1]

    for name, layout in kLayouts.items():
      self.assertLessEqual(layout.dataWords, found[name][0])
      self.assertLessEqual(layout.pointers, found[name][1])
      self.assertEqual(layout.tagAt, found.get((name, "tag"), -1))
      places = {field: (*place, None) for field, place in layout.fields.items()}
      places.update(
        {member[0]: (*member[1:], str(tag)) for tag, member in enumerate(layout.members)}
      )
      for field, (kind, place, tag) in places.items():
        declared, *rest = found[name, field]
        self.assertEqual(
          (kind, place, tag), (kTypes.get(declared, declared), *rest), f"{name}.{field}"
        )
    for name, values in kEnums.items():
      self.assertEqual([found[name, number] for number in range(len(values))], list(values))

  # The tool reads the frames of the codec, and the codec reads the frames that the tool makes of
  # them.
  def testToolAgreesOnEachKindOfItem(self):
    for sent in kindsOfItems():
      for spread in (False, True):
        text = self.capnp(
          "decode",
          kImports,
          "schema/router.capnp",
          "Frame",
          given=encodeFrame([sent], spread=spread),
        )
        back = decoded(self.capnp("encode", kImports, "schema/router.capnp", "Frame", given=text))
        self.assertTrue(covers(back[0], sent), f"{sent}\n{text.decode()}\n{back}")


class Codec(unittest.TestCase):
  def testReadsWhatItWrote(self):
    for layouts in (kLayouts, kNewerLayouts):
      for spread in (False, True):
        for sent in [kindsOfItems(), *([one] for one in kindsOfItems())]:
          back = decoded(encodeFrame(sent, layouts, spread))
          self.assertTrue(all(map(covers, back, sent)))

  def testKeepsThePayloadOfNaN(self):
    (nan,) = struct.unpack("<d", bytes.fromhex("efbeadde0000f87f"))

    (back,) = decoded(encodeFrame([item("request", message=message("float64", value=nan))]))

    self.assertTrue(math.isnan(nan))
    self.assertEqual(
      struct.pack("<d", back["body"]["message"]["body"]["value"]).hex(), "efbeadde0000f87f"
    )

  def testUnknownKindsAndEnumsAreNumbers(self):
    sent = [
      item(99, {}),
      item("request", message={"kind": 98, "body": None}),
      item("server", state=97),
    ]

    back = decoded(encodeFrame(sent))

    self.assertEqual(
      (back[0]["kind"], back[1]["body"]["message"]["kind"], back[2]["body"]["state"]), (99, 98, 97)
    )

  def testReadsTheGreetingOfTheDocument(self):
    greeting = bytes.fromhex("""
        00000000 11000000 00000000 00000100 01000000 17000000 04000000 01000100 01000000 00000000
        00000000 05000300 01000000 d0070000 86321a0c b2e74cca 00001004 00000000 00000004 00000000
        00000000 00000000 09000000 3a000000 09000000 8a000000 00000000 00000000 726f7574 65720000
        6d70662d 726f7574 657220302e312e30 0000000000000000""")

    (back,) = decoded(greeting)

    self.assertEqual(
      back,
      item(
        "greeting",
        protocolMajor=1,
        protocolMinor=0,
        router="router",
        program="mpf-router 0.1.0",
        incarnation=0xCA4CE7B20C1A3286,
        locations=[],
        maxFrameBytes=68157440,
        maxMessageBytes=67108864,
        deadTimeMs=2000,
        maxClients=0,
      ),
    )

  # The second frame of the document's example, and the differences that it lists for the reply.
  def testReadsAndWritesTheExamplesOfTheDocument(self):
    request = bytes.fromhex("""
        00000000 0f000000 00000000 00000100 01000000 17000000 04000000 01000100 0b000000 00000000
        00000000 02000100 01000000 01000000 8c203fa5 04000000 00000000 03000100 00000000 00000000
        01000000 00000000 00000000 00000000 00000000 03000000 00000000 00000000 00000000 02000000
        00000000 07000000""")
    body = message("int32", timeout=0, cmd=0, status=0, address=2, extra=0, value=7)
    sent = item("request", client=1, requestId=1, takeWithinNs=19952246924, message=body)
    self.assertEqual(decoded(request), [sent])
    self.assertEqual(encodeFrame([sent]).hex(), request.hex())

    answer = encodeFrame([item("reply", client=1, requestId=1, isFirst=True, message=body)])

    different = [at for at in range(0, len(request), 8) if request[at:at + 8] != answer[at:at + 8]]
    self.assertEqual(
      [answer[at : at + 8].hex() for at in different], ["0c00000000000000", "0100000000000000"]
    )

  # The reader either reads a damaged frame or raises an exception, in a short time.
  def testReadsOrRefusesDamagedFrames(self):
    seed = random.randrange(1 << 32)
    print(f"seed {seed}")
    random.seed(seed)
    whole = encodeFrame(kindsOfItems(), spread=True)
    for _ in range(400):
      damaged = bytearray(whole)
      for _ in range(random.randrange(1, 6)):
        damaged[random.randrange(8, len(damaged))] ^= 1 << random.randrange(8)
      reader = FrameReader(1 << 20)
      reader.feed(damaged)
      try:
        segments = reader.tryNext()
        if segments is not None:
          decodeFrame(segments)
      except (NoFrame, TooLong):
        pass

  def testRefusesManyPointersToTheSameBytes(self):
    elements = 8000
    array = struct.pack(
      "<QQ", 1 << 32 | 1 << 48, 0
    )  # the target of each item: a request and its message
    words = [1 << 48, 1 | 7 << 32 | 2 * elements << 35, elements << 2 | 1 << 32 | 1 << 48]
    for index in range(elements):
      words += [5, (2 * (elements - index) - 2) << 2 | 500 << 32]
    frame = joined([struct.pack(f"<{len(words)}Q", *words) + array + bytes(8 * 500)])

    with self.assertRaises(NoFrame):
      decoded(frame)


if __name__ == "__main__":
  unittest.main()
