# SPDX-License-Identifier: MIT
"""Link: two rings and two pools, from one of its ends."""
import ctypes
import dataclasses

import doorbell
import memory
import pool
import window

CLIENT, SERVER = 0, 1
NONE, OPEN, CLOSED, REFUSED = 0, 1, 2, 3
STATES, SENT = ("clientState", "serverState"), ("clientSent", "serverSent")
RINGS, RETURNS = ("requests", "replies"), ("requestChunks", "replyChunks")
WATCHES = ("requestWatch", "replyWatch")  # of those rings
POLLED, UNWATCHED, POLLED_UNFENCED = 0, 1, 2
CHUNK, FIRST_REPLY = 1, 2
FIRST_BYTES, MORE_BYTES = 24, 56  # of a body: in the first slot of a message, in each of the others
ENVELOPE = ("type", "flags", "requestId", "clientType", "clientExtra", "deadlineNs")


class Full(Exception):
    """The queue or its ring has no room for the message."""


@dataclasses.dataclass
class Message:
    type: int
    body: bytes = b""
    flags: int = 0
    requestId: int = 0
    clientType: int = 0
    clientExtra: int = 0
    deadlineNs: int = 0
    chunk: object = None  # (side, segment, chunk) that the body lies in
    missed: int = 0  # messages of this request that were dropped before a published one


class Ring:
    """Slots, and what their consumer says of them. `link` is the LinkControl of a ring that may continue in a second one of `more` slots."""

    def __init__(self, layout, start, slots, control, link=None, more=0):
        self.layout, self.start, self.slots, self.control = layout, start, slots, control
        self.link, self.more = link, more
        self.position = self.messages = 0

    def move(self):
        """To the second ring, which lies behind the first one."""
        self.start += self.slots * self.layout.size_of("Slot")
        self.slots, self.more = self.more, 0

    def slot(self, position, name="Slot"):
        return memory.View(self.layout, name, self.start + position % self.slots * self.layout.size_of("Slot"))


class Producer(Ring):
    moved_at = 0

    def waiting(self):
        return self.messages - self.control["taken"]

    def has_free(self, count):
        """One slot of a ring that may continue in a second one stays free, for the word that it does."""
        freed = max(self.control["freed"], self.moved_at)
        return self.position + count <= freed + self.slots - (1 if self.more else 0)

    def make_room(self, count):
        if self.has_free(count):
            return
        if not self.more or not self.link["hasMoreReplies"]:
            raise Full
        last = self.slot(self.position)
        self.move()
        self.moved_at = self.position
        self.link["repliesMoved"] = self.position + 1
        last["sequence"] = self.position + 1 | self.layout.constants["continuesInSecondRing"]
        if not self.has_free(count):
            raise Full

    def push(self, message, body, body_bytes):
        parts = [body[:FIRST_BYTES]] + [body[at : at + MORE_BYTES] for at in range(FIRST_BYTES, len(body), MORE_BYTES)]
        self.make_room(len(parts))
        slot = self.slot(self.position)
        slot["slots"], slot["bodyBytes"], slot["sentTick"] = len(parts), body_bytes, 0
        for field in ENVELOPE:
            slot[field] = getattr(message, field)
        slot["body"] = parts[0]
        for i, part in enumerate(parts[1:], start=1):
            self.slot(self.position + i, "MoreSlot")["body"] = part
        slot["sequence"] = self.position + 1
        self.position += len(parts)
        self.messages += 1


class Consumer(Ring):
    def has_message(self):
        sequence = self.slot(self.position)["sequence"]
        if self.more and self.link["hasMoreReplies"] and sequence == self.position + 1 | self.layout.constants["continuesInSecondRing"]:
            self.move()
            return self.has_message()
        return sequence == self.position + 1

    def take(self):
        """A message without its body if that is in a chunk, and how long the body is."""
        self.messages += 1
        self.control["taken"] = self.messages
        slot = self.slot(self.position)
        message = Message(**{field: slot[field] for field in ENVELOPE})
        size, count = slot["bodyBytes"], slot["slots"]
        if message.flags & CHUNK:
            ref = memory.View(self.layout, "ChunkRef", slot.address("body"))
            message.chunk, message.missed = (ref["side"], ref["segment"], ref["chunk"]), ref["missed"]
        else:
            parts = [ctypes.string_at(slot.address("body"), FIRST_BYTES)]
            more = (self.slot(self.position + i, "MoreSlot") for i in range(1, count))
            parts += [ctypes.string_at(one.address("body"), MORE_BYTES) for one in more]
            message.body = b"".join(parts)[:size]
        self.position += count
        self.control["freed"] = self.position
        return message, size


class Link:
    def __init__(self, layout, backplane, segment, side, peer):
        header = segment.header()
        self.layout, self.segment, self.side, self.peer = layout, segment, side, peer
        self.incarnation, self.header = header["incarnation"], header
        self.control = segment.view("LinkControl", header["ringBytesOffset"])
        slots = (header["queueSlots"], header["replySlots"])
        rings = segment.start + layout.constants["linkRingsOffset"]
        starts = (rings, rings + slots[0] * layout.size_of("Slot"))
        other = 1 - side
        second = ((), (self.control, header["moreReplySlots"]))  # of replies only
        self.out = Producer(layout, starts[side], slots[side], self.control.inner(RINGS[side]), *second[side])
        self.into = Consumer(layout, starts[other], slots[other], self.control.inner(RINGS[other]), *second[other])
        owners = (header["clientWindow"], header["serverWindow"])
        place = (layout, backplane, self.incarnation)
        self.pool = pool.Pool(*place, side, owners[side], self.control.inner(RETURNS[side]))
        self.borrowed = pool.Borrowed(*place, other, self.control.inner(RETURNS[other]), server_window=header["serverWindow"])
        self.peer_index = header["clientIndex"]  # a client learns its server's later
        self.state_seen = NONE

    def set_state(self, state):
        self.control[STATES[self.side]] = state
        self.peer.notify(self.peer_index)

    def peer_state(self):
        return self.control[STATES[1 - self.side]]

    def may_be_unanswered(self):
        """Requests, at present."""
        is_short = self.header["moreReplySlots"] and not self.control["hasMoreReplies"]
        return self.header["replySlots"] // 4 if is_short else self.header["maxOutstanding"]

    def allow_more(self):
        """For a client: memory for the second ring of replies."""
        if not self.control["hasMoreReplies"]:
            self.segment.reserve()
            self.control["hasMoreReplies"] = 1

    def has_news(self):
        return self.into.has_message() or self.peer_state() != self.state_seen

    def watch(self, how):
        """How we look for messages from now on. A caller that stops polling looks for messages afterwards, and only then sleeps."""
        field = WATCHES[1 - self.side]
        was = self.control[field]
        self.control[field] = how
        if was == POLLED_UNFENCED:
            doorbell.fence_in_all_processes()
        else:
            doorbell.fence()

    def send(self, message):
        """A body that lies in a chunk which it came in goes back in it; a long one goes into a chunk of ours."""
        body, size = message.body, len(message.body)
        message.flags &= ~CHUNK
        if message.chunk is None and size > self.layout.constants["inlineBodyBytes"]:
            message.chunk = self.pool.lend(body)
        if message.chunk is not None:
            side, segment, chunk = message.chunk
            cmd = int.from_bytes(message.body[4:8], "little") if self.side == CLIENT else 0
            body = b"".join(part.to_bytes(4, "little") for part in (segment, chunk, side, message.missed, cmd))
            message.flags |= CHUNK
        self.out.push(message, body, size)
        self.control[SENT[self.side]] = self.out.messages
        doorbell.fence()
        if self.control[WATCHES[self.side]] == UNWATCHED:
            self.peer.notify(self.peer_index)

    def receive(self):
        message, size = self.into.take()
        if message.chunk is not None:
            home = self.pool if message.chunk[0] == self.side else self.borrowed
            message.body = home.read(message.chunk, size)
        return message

    def done(self, message):
        """With the chunk of a message that was received."""
        if message.chunk is not None:
            (self.pool if message.chunk[0] == self.side else self.borrowed).give_back(message.chunk)

    def close(self):
        self.set_state(CLOSED)
        self.pool.close()
        if self.side == CLIENT:
            self.borrowed.remove()
            memory.remove(self.segment.name)
        self.borrowed.close()
        self.segment.close()
        self.peer.close()


def ring_slots(messages):
    return 1 << (max(16, messages + messages // 7 + 1) - 1).bit_length()


def create(layout, backplane, own, index, peer, **fields):
    """A new link of ours to a server, not yet accepted."""
    offer, queue_size = peer.header, peer.control["queueSize"]
    outstanding = 2 * queue_size
    queue_slots, all_replies = ring_slots(queue_size), ring_slots(outstanding + max(16, queue_size // 8))
    reply_slots = min(all_replies, max(64, all_replies // 4))
    more_slots = 0 if reply_slots == all_replies else all_replies
    first = layout.constants["linkRingsOffset"] + (queue_slots + reply_slots) * layout.size_of("Slot")
    segment = memory.create(
        layout,
        "link",
        first + more_slots * layout.size_of("Slot"),
        backplane,
        memory_bytes=first,
        ownerWindow=own.incarnation,
        clientWindow=own.incarnation,
        clientIndex=index,
        serverWindow=offer["incarnation"],
        name=offer["name"].encode(),
        queueSlots=queue_slots,
        replySlots=reply_slots,
        moreReplySlots=more_slots,
        queueSize=queue_size,
        maxOutstanding=outstanding,
        ringBytesOffset=layout.constants["linkControlOffset"],
        **{field: offer[field] for field in ("location", "maxMessageBytes", "maxPoolBytes", "linkMode", "linkGroup")} | fields,
    )
    control = segment.view("LinkControl", layout.constants["linkControlOffset"])
    control["clientState"] = OPEN
    for watch in WATCHES:
        control[watch] = UNWATCHED
    segment.publish(f"mpf.{backplane}.l.{offer['incarnation']:x}.{segment.header()['incarnation']:x}")
    return Link(layout, backplane, segment, CLIENT, peer)


def accept(layout, backplane, own, incarnation):
    """The link that a client has made for us. Raises FileNotFoundError, or Refused with what is wrong with it."""
    segment = memory.open_segment(layout, "link", f"mpf.{backplane}.l.{own.incarnation:x}.{incarnation:x}", writable=True)
    client = segment.header()["clientWindow"]
    peer = window.PeerWindow(layout, backplane, "clientWindow", window.keyed(backplane, "c", client))
    return Link(layout, backplane, segment, SERVER, peer)
