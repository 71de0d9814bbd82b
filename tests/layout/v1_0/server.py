# SPDX-License-Identifier: MIT
"""Server of layout 1.0. It echoes, and adds 1 to a Float64."""
import math
import os
import sys
import time

import link
import memory
import messages
import party
import reader

OFFER = {"queueSize": 32, "maxMessageBytes": 1 << 24, "maxPoolBytes": 1 << 26}


class End:
    def __init__(self, its_link):
        self.link = its_link


class Server(party.Party):
    def __init__(self, layout, backplane, name, location=0, **fields):
        super().__init__(layout, backplane, (name, location), name=name.encode(), location=location, **OFFER | fields)
        self.answered, self.limit = 0, math.inf  # requests; it takes no more than the limit

    def has_news(self):
        return self.window.is_knocked_at() or super().has_news()

    def work(self):
        if self.window.is_knocked_at():
            for incarnation in list(self.window.take_knocks()):
                for one in [incarnation] if incarnation else self.knockers():
                    self.accept(one)
        super().work()

    def knockers(self):
        prefix = f"mpf.{self.backplane}.l.{self.window.incarnation:x}."
        return [int(name.removeprefix(prefix), 16) for name in os.listdir(reader.DIRECTORY) if name.startswith(prefix)]

    def accept(self, incarnation):
        if any(end.link.incarnation == incarnation for end in self.ends.values()):
            return
        try:
            new = link.accept(self.layout, self.backplane, self.window, incarnation)
        except FileNotFoundError:
            return
        except reader.Refused:
            self.window.control.count("protocolErrors")
            return
        new.control["serverIndex"] = self.add(End(new))
        new.set_state(link.OPEN)

    def look_at(self, end):
        while self.answered < self.limit and end.link.into.has_message():
            self.window.control.count("received")
            self.window.control.count("progress")
            request = end.link.receive()
            self.show(request)
            self.answer(end.link, request)
            self.window.control["handling"] = 0
        if end.link.state_seen != link.OPEN:
            self.drop(end)

    def show(self, request):
        """What it works on, and since when."""
        cmd = int.from_bytes(bytes(request.body[4:8]), sys.byteorder)
        self.window.control["progressAtNs"] = time.monotonic_ns()
        self.window.control["handling"] = 1 << 63 | request.type << 32 | cmd

    def answer(self, end, request):
        if request.deadlineNs and time.monotonic_ns() >= request.deadlineNs:
            self.window.control.count("expired")
            end.done(request)
            request.chunk, request.type = None, messages.REQUEST_FATE
            request.body = messages.request_fate(messages.EXPIRED, request.requestId)
        elif request.type == messages.FLOAT64:
            request.body = messages.float64(messages.value(request) + 1)
        elif request.type == messages.FLOAT64_ARRAY and self.answered % 2 and request.chunk:
            end.done(request)  # a reply of our own
            request.chunk = None
        request.flags = link.FIRST_REPLY
        end.send(request)
        self.window.control.count("sent")
        self.answered += 1

    def nudge(self):
        """Clients ring again by themselves; what dead ones left is removed."""
        for end in list(self.ends.values()):
            if not end.link.peer.segment.is_locked():
                self.window.control.count("peersDied")
                end.link.borrowed.remove()
                memory.remove(end.link.segment.name)
                self.drop(end)
