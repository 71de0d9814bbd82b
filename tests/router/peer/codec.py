# SPDX-License-Identifier: MIT
# The part of Cap'n Proto that frames need: a frame is one message in standard stream framing, with
# a Frame as its root.
#
#   struct   {field: value}; with a union also kind, the name of the member or the number of an
#            unknown one, and body, its value
#   enum     its name, or the number of an unknown value
#   Data     bytes; Text is str; List(...) is a list
import struct

from layouts import kEnums, kLayouts

kMaxSegments = 512
kMaxLevels = 16
_numbers = dict(u8="<B", u16="<H", u32="<I", u64="<Q", i32="<i", i64="<q", f64="<d")
_listSizes = {"i32": 4, "f64": 5, "u8": 2}  # the code of an element's size in a list pointer
_elementBits = (0, 1, 8, 16, 32, 64, 64)


class NoFrame(Exception):
  """The bytes are not a Cap'n Proto message with a Frame."""


class TooLong(Exception):
  """The frame is longer than the receiver accepts."""


def item(kind, body=None, **fields):
  return {"kind": kind, "body": fields if body is None else body}


def padded(size):
  return -(-size // 8) * 8


# ---- writing

class _Writer:
  """Writes all objects to segment 0 or, if `spread`, each to its own one, with far pointers."""

  def __init__(self, layouts, spread):
    self.layouts_ = layouts
    self.spread_ = spread
    self.segments = [bytearray(8)]

  def newSegment(self, size):
    self.segments.append(bytearray(size))
    return len(self.segments) - 1

  def place(self, segment, at, low, high, size):
    """Allocates an object, sets the pointer at `at` to it, and returns its place."""
    word = low | high << 32
    if not self.spread_ or size == 0:  # some readers refuse empty segments
      target = len(self.segments[segment])
      self.segments[segment] += bytes(padded(size))
      self.put("u64", segment, at, word | (target - at - 8) // 8 << 2)
      return segment, target
    if len(self.segments) % 2:  # far: the landing pad precedes the object
      target = self.newSegment(8 + padded(size))
      self.put("u64", target, 0, word)
      self.put("u64", segment, at, 2 | target << 32)
      return target, 8
    target, pad = self.newSegment(padded(size)), self.newSegment(16)
    self.put("u64", pad, 0, 2 | target << 32)
    self.put("u64", pad, 8, word)
    self.put("u64", segment, at, 2 | 1 << 2 | pad << 32)
    return target, 0

  def put(self, kind, segment, at, value):
    struct.pack_into(_numbers[kind], self.segments[segment], at, value)

  def pointToStruct(self, name, segment, at, value):
    layout = self.layouts_[name]
    size = 8 * (layout.dataWords + layout.pointers)
    self.fill(
      layout, *self.place(segment, at, 0, layout.dataWords | layout.pointers << 16, size), value
    )

  def fill(self, layout, segment, at, value):
    value = {**layout.presets, **value}
    for name, (kind, place) in layout.fields.items():
      if name in value:
        self.field(layout, kind, segment, at, place, value[name])
    if not layout.members:
      return
    kind = value["kind"]
    tag = kind if isinstance(kind, int) else [member[0] for member in layout.members].index(kind)
    self.put("u16", segment, at + layout.tagAt, tag)
    if not isinstance(kind, int):
      self.field(layout, layout.members[tag][1], segment, at, layout.members[tag][2], value["body"])

  def field(self, layout, kind, segment, at, place, value):
    pointer = at + 8 * (layout.dataWords + place)
    if kind == "void":
      pass
    elif kind == "bool":
      self.put("u8", segment, at + place, int(value))
    elif kind in _numbers:
      self.put(kind, segment, at + place, value)
    elif kind in kEnums:
      self.put(
        "u16", segment, at + place, value if isinstance(value, int) else kEnums[kind].index(value)
      )
    elif kind in ("text", "data"):
      self.pointToBytes(
        segment, pointer, value.encode() + b"\0" if kind == "text" else bytes(value)
      )
    elif kind.startswith("["):
      self.pointToList(kind[1:-1], segment, pointer, value)
    else:
      self.pointToStruct(kind, segment, pointer, value)

  def pointToBytes(self, segment, at, value):
    target, start = self.place(segment, at, 1, 2 | len(value) << 3, len(value))
    self.segments[target][start:start + len(value)] = value

  def pointToList(self, kind, segment, at, values):
    if kind in _numbers:
      packed = struct.pack(f"<{len(values)}{_numbers[kind][1]}", *values)
      target, start = self.place(segment, at, 1, _listSizes[kind] | len(values) << 3, len(packed))
      self.segments[target][start:start + len(packed)] = packed
      return
    layout = self.layouts_[kind]
    size = 8 * (layout.dataWords + layout.pointers)
    target, start = self.place(
      segment, at, 1, 7 | len(values) * size // 8 << 3, 8 + len(values) * size
    )
    self.put(
      "u64", target, start, len(values) << 2 | layout.dataWords << 32 | layout.pointers << 48
    )
    for index, value in enumerate(values):
      self.fill(layout, target, start + 8 + index * size, value)


def joined(segments):
  """Segments behind their table."""
  table = struct.pack(
    f"<{len(segments) + 1}I", len(segments) - 1, *(len(segment) // 8 for segment in segments)
  )
  return table.ljust(padded(len(table)), b"\0") + b"".join(segments)


def encodeFrame(items, layouts=kLayouts, spread=False):
  writer = _Writer(layouts, spread)
  writer.pointToStruct("Frame", 0, 0, {"items": items})
  return joined(writer.segments)


# ---- reading

class FrameReader:
  """Cuts a stream of bytes into frames."""

  def __init__(self, maxBytes):
    self.maxBytes = maxBytes
    self.bytes_ = bytearray()

  def feed(self, received):
    self.bytes_ += received

  def waiting(self):
    return len(self.bytes_)

  def tryNext(self):
    """The segments of the next frame; None until it has arrived completely."""
    if len(self.bytes_) < 4:
      return None
    count = struct.unpack_from("<I", self.bytes_)[0] + 1
    if count > kMaxSegments:
      raise TooLong(f"{count} segments")
    tableBytes = padded(4 + 4 * count)
    if len(self.bytes_) < 4 + 4 * count:
      return None
    sizes = [8 * words for words in struct.unpack_from(f"<{count}I", self.bytes_, 4)]
    total = tableBytes + sum(sizes)
    if total > self.maxBytes:
      raise TooLong(f"a frame of {total} bytes")
    if len(self.bytes_) < total:
      return None
    segments = []
    at = tableBytes
    for size in sizes:
      segments.append(bytes(self.bytes_[at:at + size]))
      at += size
    del self.bytes_[:total]
    return segments


class _Reader:
  def __init__(self, segments):
    self.segments_ = segments
    self.words_ = 4 * sum(len(segment) for segment in segments) // 8 + 1024

  def word(self, segment, at):
    if segment >= len(self.segments_) or not 0 <= at <= len(self.segments_[segment]) - 8:
      raise NoFrame("a pointer outside of the message")
    return struct.unpack_from("<Q", self.segments_[segment], at)[0]

  def claim(self, segment, at, words, atLeast=0):
    """Checks that an object is within its segment, and limits the total of all objects."""
    if segment >= len(self.segments_) or at < 0 or at + 8 * words > len(self.segments_[segment]):
      raise NoFrame("an object outside of the message")
    self.words_ -= max(words, atLeast)
    if self.words_ < 0:
      raise NoFrame("too many pointers to the same bytes")

  def follow(self, segment, at, level, kind):
    """The target of the pointer at `at`: segment, byte, upper half of the pointer; None if null."""
    if level > kMaxLevels:
      raise NoFrame("too many levels")
    word = self.word(segment, at)
    if word == 0:
      return None
    start = at + 8
    if word & 3 == 2:
      segment, at, isDouble = word >> 32, (word >> 3 & 0x1FFFFFFF) * 8, word >> 2 & 1
      word, start = self.word(segment, at), at + 8
      if isDouble:
        tag = self.word(segment, at + 8)
        if word & 7 != 2:
          raise NoFrame("a landing pad without a far pointer")
        segment, start, word = word >> 32, (word >> 3 & 0x1FFFFFFF) * 8, tag
    if word & 3 != kind:
      raise NoFrame("another kind of pointer")
    offset = word >> 2 & 0x3FFFFFFF
    return segment, start + 8 * (offset - (offset >> 29 << 30)), word >> 32

  def struct(self, name, segment, at, level):
    found = self.follow(segment, at, level, 0)
    if found is None:
      return self.content(kLayouts[name], 0, 0, 0, 0, level)
    segment, start, sizes = found
    self.claim(segment, start, (sizes & 0xFFFF) + (sizes >> 16))
    return self.content(kLayouts[name], segment, start, sizes & 0xFFFF, sizes >> 16, level)

  def content(self, layout, segment, start, dataWords, pointers, level):
    """Reads a struct; fields beyond its end have their default values."""
    def field(kind, place):
      if kind == "void":
        return None
      if kind == "bool":
        return place < 8 * dataWords and bool(self.segments_[segment][start + place] & 1)
      if kind in _numbers or kind in kEnums:
        number = _numbers.get(kind, "<H")
        value = (
          struct.unpack_from(number, self.segments_[segment], start + place)[0]
          if place < 8 * dataWords
          else 0
        )
        return kEnums[kind][value] if kind in kEnums and value < len(kEnums[kind]) else value
      where = (segment, start + 8 * (dataWords + place)) if place < pointers else None
      if kind in ("text", "data"):
        return self.bytes(kind, where, level + 1)
      if kind.startswith("["):
        return self.list(kind[1:-1], where, level + 1)
      return (
        self.struct(kind, *where, level + 1)
        if where
        else self.content(kLayouts[kind], 0, 0, 0, 0, level + 1)
      )

    value = {name: field(*place) for name, place in layout.fields.items()}
    if layout.members:
      tag = field("u16", layout.tagAt)
      name, *place = layout.members[tag] if tag < len(layout.members) else (tag, "void", 0)
      value.update(kind=name, body=field(*place))
    return value

  def listAt(self, where, level):
    """Segment, first byte, code of the element's size, number of elements (code 7: of words)."""
    found = self.follow(*where, level, 1) if where else None
    return found and (found[0], found[1], found[2] & 7, found[2] >> 3)

  def bytes(self, kind, where, level):
    found = self.listAt(where, level)
    if found is None:
      return "" if kind == "text" else b""
    segment, start, code, count = found
    if code != 2:
      raise NoFrame("bytes of another size")
    self.claim(segment, start, padded(count) // 8)
    value = self.segments_[segment][start:start + count]
    if kind == "data":
      return value
    if not value.endswith(b"\0"):
      raise NoFrame("a text without its end")
    return value[:-1].decode(errors="replace")

  def list(self, kind, where, level):
    found = self.listAt(where, level)
    if found is None:
      return []
    segment, start, code, count = found
    if kind in _numbers:
      if code != _listSizes[kind]:
        raise NoFrame("elements of another size")
      self.claim(segment, start, padded(count * _elementBits[code] // 8) // 8)
      return list(
        struct.unpack_from(f"<{count}{_numbers[kind][1]}", self.segments_[segment], start)
      )
    if code != 7:
      raise NoFrame("a list of structs without a tag")
    tag = self.word(segment, start)
    elements, dataWords, pointers = tag >> 2 & 0x3FFFFFFF, tag >> 32 & 0xFFFF, tag >> 48
    self.claim(segment, start, 1 + count, atLeast=elements)  # an element of size 0 counts as a word
    if tag & 3 or elements * (dataWords + pointers) > count:
      raise NoFrame("a list that is shorter than its elements")
    size = 8 * (dataWords + pointers)
    return [
      self.content(kLayouts[kind], segment, start + 8 + index * size, dataWords, pointers, level)
      for index in range(elements)
    ]


def decodeFrame(segments):
  return _Reader(segments).struct("Frame", 0, 0, 1)["items"]
