# SPDX-License-Identifier: MIT
"""Server of layout 1.0. It echoes, and adds 1 to a Float64. Some arrays it publishes."""
import math
import os
import sys
import time

import link
import memory
import messages
import party
import pool
import reader

MOST_PUBLISHED = 4  # chunks that one client may hold
OFFER = {"queueSize": 32, "maxMessageBytes": 1 << 24, "maxPoolBytes": 1 << 26}


class End:
    def __init__(self, its_link):
        self.link = its_link


class Server(party.Party):
    def __init__(self, layout, backplane, name, location=0, **fields):
        super().__init__(layout, backplane, (name, location), name=name.encode(), location=location, **OFFER | fields)
        self.fan_out, self.published = pool.FanOut(layout, backplane, self.window.incarnation), 0
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
            request.chunk = self.publish(end, request.body) if self.answered % 4 == 3 else None
        request.flags = link.FIRST_REPLY
        end.send(request)
        self.window.control.count("sent")
        self.answered += 1

    def publish(self, end, body):
        """The chunk of a body that many clients could read; None if this client holds too many."""
        end.pool.collect()
        if len(end.pool.published) >= MOST_PUBLISHED:
            return None
        number = self.fan_out.claim(body, {n for other in self.ends.values() for n in other.link.pool.published})
        end.pool.published.append(number)
        self.published += 1
        return pool.FAN_OUT, number, 0

    def drop(self, end):
        its_pool, is_alive = end.link.pool, end.link.peer.segment.is_locked()
        its_pool.collect()
        if is_alive or end.link.peer_state() == link.CLOSED:
            self.fan_out.retire(its_pool.published)
        super().drop(end)

    def close(self):
        super().close()
        self.fan_out.close()

    def nudge(self):
        """Clients ring again by themselves; what dead ones left is removed."""
        for end in list(self.ends.values()):
            if not end.link.peer.segment.is_locked():
                self.window.control.count("peersDied")
                end.link.borrowed.remove()
                memory.remove(end.link.segment.name)
                self.drop(end)
