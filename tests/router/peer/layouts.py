# SPDX-License-Identifier: MIT
# The frozen layouts of the structs on the wire: the output of `capnp compile -ocapnp` for
# schema/router.capnp and schema/message.capnp at protocol 1.0. codec_test.py compares them with
# today's schemas, which may have additional fields but no other changes.
#
#   Layout(words of data, pointers, {field: (type, place)})
#   place    byte of the data section, or index of the pointer
#   a union  the place of its discriminant, and its members in order
from typing import NamedTuple


class Layout(NamedTuple):
  dataWords: int
  pointers: int
  fields: dict = {}
  tagAt: int = -1     # byte of the discriminant; -1: no union
  members: tuple = ()  # (name, type, place)
  presets: dict = {}  # values of fields that a writer does not set


kEnums = {
    "Code": ("stopping", "version", "protocol", "limit", "silence", "notAllowed"),
    "State": ("absent", "there", "refused"),
    "Fate": ("refused", "neverTaken", "outcomeUnknown", "expired", "cancelled"),
    "ConnectStatus": ("connectNo", "connectYes", "connectQueueFull", "connectRefused"),
}

_standard = {
  "timeout": ("i32", 0),
  "cmd": ("i32", 4),
  "status": ("i32", 8),
  "address": ("i32", 12),
  "extra": ("i32", 16),
}

kLayouts = {
  # router.capnp
  "Frame": Layout(0, 1, {"items": ("[Item]", 0)}),
  "Item": Layout(
    1,
    1,
    tagAt=0,
    members=(
      ("none", "void", 0),
      ("greeting", "Greeting", 0),
      ("farewell", "Farewell", 0),
      ("ping", "Ping", 0),
      ("pong", "Ping", 0),
      ("bind", "Bind", 0),
      ("unbind", "u32", 4),
      ("server", "Server", 0),
      ("open", "Open", 0),
      ("close", "u32", 4),
      ("refuse", "Refusal", 0),
      ("request", "Request", 0),
      ("reply", "Reply", 0),
      ("fate", "RequestEnd", 0),
      ("queueFull", "u32", 4),
      ("credit", "Credit", 0),
    ),
  ),
  "Greeting": Layout(
    5,
    3,
    {
      "protocolMajor": ("u16", 0),
      "protocolMinor": ("u16", 2),
      "router": ("text", 0),
      "program": ("text", 1),
      "incarnation": ("u64", 8),
      "locations": ("[i32]", 2),
      "maxFrameBytes": ("u64", 16),
      "maxMessageBytes": ("u64", 24),
      "deadTimeMs": ("u32", 4),
      "maxClients": ("u32", 32),
    },
  ),
  "Farewell": Layout(1, 1, {"reason": ("text", 0), "code": ("Code", 0)}),
  "Ping": Layout(1, 0, {"stamp": ("u64", 0)}),
  "Bind": Layout(1, 1, {"binding": ("u32", 0), "location": ("i32", 4), "server": ("text", 0)}),
  "Server": Layout(
    4,
    1,
    {
      "binding": ("u32", 0),
      "state": ("State", 4),
      "incarnation": ("u64", 8),
      "queueSize": ("u32", 16),
      "maxMessageBytes": ("u64", 24),
      "reason": ("text", 0),
      "maxOutstanding": ("u32", 20),
      "hops": ("u16", 6),
    },
  ),
  "Open": Layout(
    3,
    0,
    {"client": ("u32", 0), "binding": ("u32", 4), "incarnation": ("u64", 8), "window": ("u32", 16)},
  ),
  "Refusal": Layout(1, 1, {"client": ("u32", 0), "reason": ("text", 0)}),
  "Request": Layout(
    2,
    1,
    {
      "client": ("u32", 0),
      "requestId": ("u32", 4),
      "takeWithinNs": ("u64", 8),
      "message": ("Envelope", 0),
    },
  ),
  "Reply": Layout(
    2,
    1,
    {
      "client": ("u32", 0),
      "requestId": ("u32", 4),
      "isFirst": ("bool", 8),
      "message": ("Envelope", 0),
    },
  ),
  "RequestEnd": Layout(
    2,
    1,
    {"client": ("u32", 0), "requestId": ("u32", 4), "fate": ("Fate", 8), "reason": ("text", 0)},
  ),
  "Credit": Layout(1, 0, {"client": ("u32", 0), "bytes": ("u32", 4)}),
  # message.capnp
  "Envelope": Layout(
    3,
    1,
    {"clientType": ("i32", 0), "clientExtra": ("i32", 4), "timeStampNs": ("i64", 16)},
    tagAt=8,
    members=(
      ("connect", "Connect", 0),
      ("int32", "Int32Value", 0),
      ("int32Array", "Int32Array", 0),
      ("float64", "Float64Value", 0),
      ("float64Array", "Float64Array", 0),
      ("char8Array", "Char8Array", 0),
      ("serialConfig", "SerialConfig", 0),
      ("outOfBand", "OutOfBand", 0),
      ("requestFate", "RequestFate", 0),
      ("user", "User", 0),
    ),
  ),
  "Connect": Layout(2, 0, {"status": ("ConnectStatus", 0), "incarnation": ("u64", 8)}),
  "Int32Value": Layout(3, 0, {**_standard, "value": ("i32", 20)}),
  "Int32Array": Layout(3, 1, {**_standard, "value": ("[i32]", 0)}),
  "Float64Value": Layout(4, 0, {**_standard, "value": ("f64", 24)}),
  "Float64Array": Layout(3, 1, {**_standard, "value": ("[f64]", 0)}),
  "Char8Array": Layout(
    4,
    2,
    {
      **_standard,
      "numberRetrys": ("i32", 20),
      "eomLen": ("i32", 24),
      "eomString": ("data", 0),
      "value": ("data", 1),
    },
  ),
  "SerialConfig": Layout(
    2,
    0,
    {
      "baud": ("i32", 0),
      "stopBits": ("i32", 4),
      "bitsPerChar": ("i32", 8),
      "parity": ("u8", 12),
      "flowControl": ("u8", 13),
    },
  ),
  "OutOfBand": Layout(3, 0, {**_standard, "value": ("i32", 20)}),
  "RequestFate": Layout(1, 0, {"fate": ("Fate", 0), "requestId": ("u32", 4)}),
  "User": Layout(0, 1, {"value": ("data", 0)}),
}


def _newer(layout):
  fields = {
    **layout.fields,
    "newNumber": ("u64", 8 * layout.dataWords),
    "newText": ("text", layout.pointers),
  }
  members = layout.members and (*layout.members, ("novelty", "text", 0))
  return Layout(layout.dataWords + 1, layout.pointers + 1, fields, layout.tagAt, members,
                {"newNumber": 0xFEDCBA9876543210, "newText": "of a later minor version"})


# An invented minor version after 1.0: each struct has an additional number and text, and each union
# has an additional member, "novelty".
kNewerLayouts = {name: _newer(layout) for name, layout in kLayouts.items()}

# An invented minor version before 1.0: without the texts that only inform, and without a limit that
# may be 0.
kOlderLayouts = {
  **kLayouts,
  "Greeting": Layout(
    4,
    3,
    {name: place for name, place in kLayouts["Greeting"].fields.items() if name != "maxClients"},
  ),
  "Server": Layout(
    4, 0, {name: place for name, place in kLayouts["Server"].fields.items() if name != "reason"}
  ),
  "RequestEnd": Layout(
    2, 0, {name: place for name, place in kLayouts["RequestEnd"].fields.items() if name != "reason"}
  ),
  "Refusal": Layout(1, 0, {"client": ("u32", 0)}),
  "Farewell": Layout(1, 0, {"code": ("Code", 0)}),
}
