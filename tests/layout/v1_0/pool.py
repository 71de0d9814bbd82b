# SPDX-License-Identifier: MIT
"""Pool: chunks for messages that do not fit a ring; our own, those that the peer lends us, and those that a server publishes to many clients. A
chunk is (side, segment, number)."""
import ctypes
import os

import memory

FAN_OUT = 2  # the side of a published chunk


class Chunks:
    """The bulk segments of one side of a link."""

    def __init__(self, layout, backplane, link, side, returns):
        self.layout, self.backplane, self.side, self.returns = layout, backplane, side, returns
        self.prefix = f"mpf.{backplane}.b.{link:x}.{side}."
        self.segments = {}  # by number

    def address(self, chunk):
        segment = self.segments[chunk[1]]
        return segment.start + self.layout.constants["bulkChunksOffset"] + chunk[2] * segment.header()["chunkBytes"]

    def read(self, chunk, size):
        return ctypes.string_at(self.address(chunk), size)

    def remove(self):
        number = 0
        while memory.remove(f"{self.prefix}{number}"):
            number += 1

    def close(self):
        for segment in self.segments.values():
            segment.close()


class Pool(Chunks):
    """Ours: a segment of two chunks whenever none is free that is large enough."""

    def __init__(self, layout, backplane, link, side, owner, returns):
        super().__init__(layout, backplane, link, side, returns)
        self.owner = owner
        self.free, self.lent = [], set()
        self.published = []  # numbers of the chunks of the fan-out pool that this client holds
        self.collected = 0

    def lend(self, body):
        self.collect()
        fitting = [chunk for chunk in self.free if self.segments[chunk[1]].header()["chunkBytes"] >= len(body)]
        chunk = fitting[0] if fitting else self.add(-(-len(body) // 64) * 64)
        self.free.remove(chunk)
        self.lent.add(chunk)
        ctypes.memmove(self.address(chunk), body, len(body))
        return chunk

    def add(self, chunk_bytes):
        number, count = len(self.segments), 2
        size = self.layout.constants["bulkChunksOffset"] + count * chunk_bytes
        fields = {"ownerWindow": self.owner, "chunkBytes": chunk_bytes, "chunkCount": count, "bulkSide": self.side}
        segment = memory.create(self.layout, "bulk", size, self.backplane, **fields)
        segment.publish(f"{self.prefix}{number}")
        self.segments[number] = segment
        self.free += [(self.side, number, chunk) for chunk in range(count)]
        return self.free[-1]

    def collect(self):
        """What the peer has returned."""
        while self.collected < self.returns["returned"]:
            packed = self.returns["chunks", self.collected % self.layout.constants["returnSlots"]]
            fan_out = self.layout.constants["returnsFanOut"]
            if packed & fan_out:
                if packed - fan_out in self.published:
                    self.published.remove(packed - fan_out)
            else:
                self.give_back((self.side, packed >> 16, packed & 0xFFFF))
            self.collected += 1

    def give_back(self, chunk):
        """A chunk that is ours again, through the return ring or in a reply."""
        self.lent.remove(chunk)
        self.free.append(chunk)

    def close(self):
        self.remove()
        super().close()


class Borrowed(Chunks):
    """The peer's, and what a server publishes."""

    def __init__(self, *place, server_window):
        super().__init__(*place)
        self.published = f"mpf.{self.backplane}.p.{server_window:x}."
        self.returned = 0

    def read(self, chunk, size):
        if chunk[0] == FAN_OUT:
            return self.read_published(chunk[1], size)
        if chunk[1] not in self.segments:
            self.segments[chunk[1]] = memory.open_segment(self.layout, "bulk", f"{self.prefix}{chunk[1]}", writable=True)
        return super().read(chunk, size)

    def read_published(self, number, size):
        segment = memory.open_segment(self.layout, "fanOut", f"{self.published}{number}", writable=False)
        try:
            return ctypes.string_at(segment.start + self.layout.constants["bulkChunksOffset"], size)
        finally:
            segment.close()

    def give_back(self, chunk):
        packed = self.layout.constants["returnsFanOut"] | chunk[1] if chunk[0] == FAN_OUT else chunk[1] << 16 | chunk[2]
        self.returns["chunks", self.returned % self.layout.constants["returnSlots"]] = packed
        self.returned += 1
        self.returns["returned"] = self.returned


class FanOut:
    """A server's: one chunk in each file, which its clients map for reading only. A chunk is free when the list of no client contains it."""

    def __init__(self, layout, backplane, window):
        self.layout, self.window, self.backplane = layout, window, backplane
        self.segments, self.retired, self.made = {}, set(), 0  # by number

    def name(self, number):
        return f"mpf.{self.backplane}.p.{self.window:x}.{number}"

    def claim(self, body, held):
        """The number of a chunk with this body; `held` are the numbers in the lists of all clients."""
        for number in self.retired - held:
            self.remove(number)
        fitting = [n for n, one in self.segments.items() if n not in held and one.header()["chunkBytes"] >= len(body)]
        number = fitting[0] if fitting else self.add(-(-len(body) // 4096) * 4096)
        ctypes.memmove(self.segments[number].start + self.layout.constants["bulkChunksOffset"], body, len(body))
        return number

    def add(self, chunk_bytes):
        number, self.made = self.made, self.made + 1
        fields = {"ownerWindow": self.window, "serverWindow": self.window, "chunkBytes": chunk_bytes, "chunkCount": 1}
        segment = memory.create(self.layout, "fanOut", self.layout.constants["bulkChunksOffset"] + chunk_bytes, self.backplane, **fields)
        os.fchmod(segment.fd, 0o400)
        segment.publish(self.name(number))
        self.segments[number] = segment
        return number

    def retire(self, numbers):
        """A client has ended its link and may still read these chunks: they are never written again."""
        self.retired |= set(numbers)

    def remove(self, number):
        memory.remove(self.name(number))
        self.segments.pop(number).close()
        self.retired.discard(number)

    def close(self):
        for number in list(self.segments):
            self.remove(number)
