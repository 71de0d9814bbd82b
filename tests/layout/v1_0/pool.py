# SPDX-License-Identifier: MIT
"""Pool: chunks for messages that do not fit a ring; our own, and those that the peer lends us. A chunk is (side, segment, number)."""
import ctypes

import memory


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
    """The peer's."""

    def __init__(self, *place):
        super().__init__(*place)
        self.returned = 0

    def read(self, chunk, size):
        if chunk[1] not in self.segments:
            self.segments[chunk[1]] = memory.open_segment(self.layout, "bulk", f"{self.prefix}{chunk[1]}", writable=True)
        return super().read(chunk, size)

    def give_back(self, chunk):
        self.returns["chunks", self.returned % self.layout.constants["returnSlots"]] = chunk[1] << 16 | chunk[2]
        self.returned += 1
        self.returns["returned"] = self.returned
