# SPDX-License-Identifier: MIT
"""PendingBind: shows whom a client waits for, and tells when a name appears (inotify: a segment's name is created, complete, by link())."""
import ctypes
import os

import memory
import reader
import window
from memory import libc

IN_CREATE = 0x100


class PendingBind:
    def __init__(self, layout, backplane, own, server, location):
        size = layout.size_of("SegmentHeader")
        fields = {"ownerWindow": own.incarnation, "name": server.encode(), "location": location}
        self.segment = memory.create(layout, "pendingBind", size, backplane, **fields)
        self.segment.publish(window.keyed(backplane, "w", self.segment.header()["incarnation"]))
        self.awaited = os.path.join(reader.DIRECTORY, window.server_window(backplane, server, location))
        self.names = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)  # readable when there is a new name
        if libc.inotify_add_watch(self.names, reader.DIRECTORY.encode(), IN_CREATE) < 0:
            raise OSError(ctypes.get_errno(), "inotify_add_watch")

    def is_granted(self):
        try:
            os.read(self.names, 1 << 16)
        except BlockingIOError:
            pass
        return os.path.exists(self.awaited)

    def close(self):
        memory.remove(self.segment.name)
        self.segment.close()
        os.close(self.names)
