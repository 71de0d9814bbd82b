# SPDX-License-Identifier: MIT
"""Party: a program of layout 1.1 that takes part, a client or a server, and how it waits."""
import doorbell
import window

OWN_RIGHTS = {"waitMode": 2, "linkMode": 0o600, "linkGroup": 0xFFFFFFFF}


class Party:
    def __init__(self, layout, backplane, server, **fields):
        self.layout, self.backplane = layout, backplane
        self.window = window.OwnWindow(layout, backplane, server, **OWN_RIGHTS | fields)
        self.ends = {}  # of links, by their bit in our window
        self.is_closed = False

    def add(self, end):
        index = next(index for index in range(self.layout.constants["maxLinks"]) if index not in self.ends)
        self.ends[index] = end
        self.window.control["linkCount"] = len(self.ends)
        self.window.control.count("linksOpened")
        return index

    def drop(self, end):
        index = next(index for index, other in self.ends.items() if other is end)
        del self.ends[index]
        end.link.close()
        self.window.control["linkCount"] = len(self.ends)
        self.window.control.count("linksClosed")

    def has_news(self):
        return any(end.link.has_news() for end in self.ends.values())

    def work(self):
        """All that there is to do now."""
        self.window.take_ready()
        for end in list(self.ends.values()):
            end.link.state_seen = end.link.peer_state()
            self.look_at(end)

    def close(self):
        """As a program that leaves in order. Once."""
        self.window.control["state"] = window.CLOSED
        for end in list(self.ends.values()):
            self.drop(end)
        self.window.close()
        self.is_closed = True


def run_until(done, *parties, files=(), sleep=doorbell.sleep_on_pipes):
    """The parties work until done(); in between they sleep, until one of them is rung or one of `files` is readable."""
    while True:
        for party in parties:
            party.work()
        if done():
            return
        if not sleep(parties, files):
            for party in parties:
                party.nudge()
