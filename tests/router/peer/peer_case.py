# SPDX-License-Identifier: MIT
# The common part of the tests of both roles: the real programs, a watchdog, messages of every type,
# and the protocol versions of the peer.
import os
import struct
import sys
import unittest

from codec import encodeFrame, item
from programs import Programs

kWatchdogSeconds = 900
kNaN = struct.unpack("<d", bytes.fromhex("efbeadde0000f87f"))[0]
# Protocol 1.0, a later and an earlier minor version, and 1.0 with many segments.
kSpeech = ({}, {"version": "newer", "protocolMinor": 1}, {"version": "older"}, {"spread": True})


def message(kind, clientType=0, clientExtra=0, timeStampNs=0, **body):
  return {
    "clientType": clientType,
    "clientExtra": clientExtra,
    "timeStampNs": timeStampNs,
    "kind": kind,
    "body": body,
  }


def inBytes(envelope):
  """The bytes of a message, so that NaNs compare by their bits."""
  return encodeFrame([item("reply", message=envelope)])


_standard = {"timeout": 1, "cmd": 2, "status": -3, "address": 4, "extra": 5}
kMessages = (
  message("int32", 11, -12, **_standard, value=-7),
  message("int32Array", **_standard, value=[1, -2, 3]),
  message("float64", **_standard, value=kNaN),
  message("float64Array", **_standard, value=[0.5, kNaN, -0.0]),
  message(
    "char8Array",
    **_standard,
    numberRetrys=6,
    eomLen=2,
    eomString=b"\r\n\0\0",
    value=bytes(range(256)),
  ),
  message(
    "serialConfig", baud=9600, stopBits=1, bitsPerChar=8, parity=ord("E"), flowControl=ord("N")
  ),
  message("outOfBand", **_standard, value=9),
  message("user", value=encodeFrame([])),
)


class PeerCase(unittest.TestCase):
  folder = ""  # of the programs

  def setUp(self):
    self.programs = Programs(self.folder)
    self.watchdog = self.programs.watchdog(kWatchdogSeconds)
    self.near = self.programs.backplane("near")

  def tearDown(self):
    self.programs.stopAll()
    self.watchdog.cancel()


def main():
  """FILE FOLDER-OF-THE-PROGRAMS [arguments of unittest]"""
  PeerCase.folder = os.path.abspath(sys.argv.pop(1))
  unittest.main("__main__")
