# SPDX-License-Identifier: MIT
"""Window: our own with its hints and its pipe, locked for as long as we live; and those of peers."""
import os

import doorbell
import memory
import reader

OPEN, CLOSED = 1, 2


def keyed(backplane, letter, incarnation):
    return f"mpf.{backplane}.{letter}.{incarnation:x}"


def server_window(backplane, server, location):
    return f"mpf.{backplane}.s.{location}.{memory.encode_server(server)}"


class OwnWindow:
    """`server`: name and location of a server; None: a client's window."""

    def __init__(self, layout, backplane, server, **fields):
        kind = "serverWindow" if server else "clientWindow"
        constants = layout.constants
        self.segment = memory.create(layout, kind, constants["windowControlOffset"] + layout.size_of("WindowControl"), backplane, **fields)
        self.segment.lock()
        self.control = self.segment.view("WindowControl", constants["windowControlOffset"])
        self.control["state"] = OPEN
        if server:
            self.control["queueSize"] = fields["queueSize"]
        self.incarnation = self.segment.header()["incarnation"]

        self.hints_segment = memory.create(layout, "hints", layout.size_of("WindowHints"), backplane, ownerWindow=self.incarnation)
        self.hints_segment.lock()
        self.hints_segment.publish(keyed(backplane, "h", self.incarnation))
        self.hints = self.hints_segment.view("WindowHints")
        self.knocked = 0
        self.hinted = set()  # bits that peers have set so far

        self.pipe_name = keyed(backplane, "f", self.incarnation)
        path = os.path.join(reader.DIRECTORY, self.pipe_name)
        os.mkfifo(path, 0o600)
        self.pipe = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        self.segment.publish(server_window(backplane, *server) if server else keyed(backplane, "c", self.incarnation))

    def announce(self, how):
        self.control["sleeping"] = how
        doorbell.fence()

    def withdraw(self):
        self.control["sleeping"] = doorbell.AWAKE
        self.control.count("wakes")
        try:
            while os.read(self.pipe, 256):
                pass
        except BlockingIOError:
            pass

    def take_ready(self):
        """Withdraws the ready bits. What they stand for is looked at afterwards."""
        for word in range(4):
            for place in bits(self.hints["readyWords", word]):
                doorbell.clear_bit(self.hints.address("readyWords", word), place)
                self.take_ready_word(64 * word + place)

    def take_ready_word(self, word):
        for bit in bits(self.hints["readyBits", word]):
            doorbell.clear_bit(self.hints.address("readyBits", word), bit)
            self.hinted.add(64 * word + bit)

    def is_knocked_at(self):
        return self.hints["knocked"] != self.knocked or self.hints["rescan"] != 0

    def take_knocks(self):
        """Incarnations of links that want to be accepted; None among them: look for links by name. One that is overwritten comes again."""
        self.knocked = self.hints["knocked"]
        if self.hints["rescan"]:
            self.hints["rescan"] = 0
            yield None
        for place in range(self.segment.layout.constants["knocks"]):
            link = self.hints["knocks", place]
            if link:
                self.hints["knocks", place] = 0
                yield link

    def close(self):
        self.control["state"] = CLOSED
        for name in (self.pipe_name, self.hints_segment.name, self.segment.name):
            memory.remove(name)
        os.close(self.pipe)
        self.hints_segment.close()
        self.segment.close()


class PeerWindow:
    def __init__(self, layout, backplane, kind, name):
        self.segment = memory.open_segment(layout, kind, name, writable=False)
        self.header = self.segment.header()
        incarnation = self.header["incarnation"]
        self.control = self.segment.view("WindowControl", layout.constants["windowControlOffset"])
        self.hints_segment = memory.open_segment(layout, "hints", keyed(backplane, "h", incarnation), writable=True)
        self.hints = self.hints_segment.view("WindowHints")
        self.pipe_name = keyed(backplane, "f", incarnation)

    def is_there(self):
        return self.segment.is_locked() and self.control["state"] == OPEN

    def notify(self, index):
        """Link `index` of it has news, which were stored before."""
        doorbell.set_bit(self.hints.address("readyBits", index // 64), index % 64)
        doorbell.set_bit(self.hints.address("readyWords", index // 64 // 64), index // 64 % 64)
        self.wake()

    def knock(self, link):
        place = link % self.segment.layout.constants["knocks"]
        if self.hints["knocks", place] not in (0, link):
            self.hints["rescan"] = 1
        self.hints["knocks", place] = link
        doorbell.change(self.hints.address("knocked"), doorbell.ADD, 1)
        self.wake()

    def wake(self):
        doorbell.fence()
        how = self.control["sleeping"]
        if how == doorbell.ON_BELL:
            doorbell.ring(self.hints.address("bell"))
        elif how == doorbell.ON_PIPE:
            doorbell.ring_pipe(self.pipe_name)

    def close(self):
        self.hints_segment.close()
        self.segment.close()


def bits(word):
    return [bit for bit in range(64) if word >> bit & 1]
