# SPDX-License-Identifier: MIT
"""Client of layout 1.0."""
import itertools

import link
import party
import pending_bind
import window


class Connection:
    """To one server, until that is gone."""

    def __init__(self):
        self.link = None
        self.is_open = self.is_closed = False
        self.unanswered = set()  # ids
        self.received = []  # messages
        self.last_id = 0

    def send(self, kind, body, **envelope):
        """Returns the request's id."""
        size = 1 << (self.link.header["maxOutstanding"] - 1).bit_length()
        if len(self.unanswered) >= self.link.header["maxOutstanding"] or self.link.out.waiting() >= self.link.header["queueSize"]:
            raise link.Full
        if len(self.unanswered) >= self.link.may_be_unanswered():
            self.link.allow_more()
        # The server knows an unanswered request by its place in a table of that size.
        new = (i for i in itertools.count(self.last_id + 1) if all((i - other) % size for other in self.unanswered))
        self.last_id = next(new)
        self.link.send(link.Message(kind, body, requestId=self.last_id, **envelope))
        self.unanswered.add(self.last_id)
        return self.last_id


class Client(party.Party):
    def __init__(self, layout, backplane, label="", **fields):
        super().__init__(layout, backplane, None, name=label.encode(), **fields)

    def pending_bind(self, server, location=0):
        return pending_bind.PendingBind(self.layout, self.backplane, self.window, server, location)

    def connect(self, server, location=0, **fields):
        """Raises FileNotFoundError, or Refused with what is wrong with the server's window."""
        name = window.server_window(self.backplane, server, location)
        peer = window.PeerWindow(self.layout, self.backplane, "serverWindow", name)
        if not peer.is_there():
            raise FileNotFoundError(name)
        connection = Connection()
        index = self.add(connection)
        connection.link = link.create(self.layout, self.backplane, self.window, index, peer, **fields)
        peer.knock(connection.link.incarnation)
        return connection

    def look_at(self, connection):
        end = connection.link
        if end.state_seen == link.OPEN and not connection.is_open:
            end.peer_index = end.control["serverIndex"]
            connection.is_open = True
        while end.into.has_message():
            message = end.receive()
            end.done(message)
            self.window.control.count("received")
            if message.flags & link.FIRST_REPLY:
                connection.unanswered.discard(message.requestId)
                end.control["clientAnswered"] += 1
            connection.received.append(message)
        if end.state_seen in (link.CLOSED, link.REFUSED):
            connection.is_closed = True
            self.drop(connection)

    def nudge(self):
        """Our hints may have got lost, and servers die."""
        for connection in list(self.ends.values()):
            peer = connection.link.peer
            if not peer.segment.is_locked():
                connection.is_closed = True
                self.drop(connection)
            elif not connection.is_open:
                peer.knock(connection.link.incarnation)
            elif connection.unanswered:
                peer.notify(connection.link.peer_index)
