# SPDX-License-Identifier: MIT
"""Memory: segments of layout 1.0, made and mapped, and the structs in them, read and written in place.

A word is loaded and stored at once (ctypes copies an aligned word with one instruction). Words are seen by others in the order in which
they were written because x86 keeps it; nothing here would do on a processor that does not.
"""
import ctypes
import fcntl
import mmap
import os
import re
import secrets
import struct
import time

import reader

CTYPES = {"u8": ctypes.c_uint8, "u16": ctypes.c_uint16, "u32": ctypes.c_uint32, "u64": ctypes.c_uint64, "i32": ctypes.c_int32, "i64": ctypes.c_int64}

libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]


class View:
    """A struct where it lies: view["state"], view["knocks", 5], view.inner("requests")["taken"]."""

    def __init__(self, layout, name, address):
        self.layout, self.fields, self.start = layout, layout.structs[name], address

    def address(self, field, index=0):
        offset, kind = self.fields[field]
        element = kind.split("[")[0]
        return self.start + offset + index * (1 if element == "char" else self.layout.size_of(element))

    def inner(self, field):
        return View(self.layout, self.fields[field][1], self.address(field))

    def word(self, key):
        field, index = key if isinstance(key, tuple) else (key, 0)
        return CTYPES[self.fields[field][1].split("[")[0]].from_address(self.address(field, index))

    def __getitem__(self, key):
        return self.word(key).value

    def __setitem__(self, key, value):
        if isinstance(value, bytes):
            ctypes.memmove(self.address(key), value, len(value))
        else:
            self.word(key).value = value

    def count(self, field, more=1):
        self[field] += more


class Segment:
    """A mapped file. `fd` holds the owner's lock, if it has one."""

    def __init__(self, layout, fd, size, writable):
        self.layout, self.fd, self.bytes, self.name = layout, fd, size, None
        access = mmap.PROT_READ | (mmap.PROT_WRITE if writable else 0)
        self.start = libc.mmap(None, size, access, mmap.MAP_SHARED, fd, 0)
        if self.start == ctypes.c_void_p(-1).value:
            raise OSError(ctypes.get_errno(), "mmap")

    def header(self):
        """A copy, as a dictionary."""
        return self.layout.read(ctypes.string_at(self.start, self.layout.size_of("SegmentHeader")), "SegmentHeader", 0)

    def view(self, name, offset=0):
        return View(self.layout, name, self.start + offset)

    def lock(self):
        """The owner's: of the whole file, until we close it or die."""
        fcntl.fcntl(self.fd, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))

    is_locked = reader.Segment.is_locked

    def publish(self, name):
        directory = os.open(reader.DIRECTORY, os.O_PATH | os.O_CLOEXEC)
        try:  # with a directory given, Python calls linkat(), which follows the link in /proc
            os.link(f"/proc/self/fd/{self.fd}", name, dst_dir_fd=directory)
        finally:
            os.close(directory)
        self.name = name

    def reserve(self):
        os.posix_fallocate(self.fd, 0, self.bytes)

    def close(self):
        libc.munmap(self.start, self.bytes)
        os.close(self.fd)


def create(layout, kind, size, backplane, memory_bytes=None, **fields):
    """A segment without a name, its header filled in; `fields` are added to it. Only its first bytes may have memory."""
    fd = os.open(reader.DIRECTORY, os.O_TMPFILE | os.O_RDWR | os.O_CLOEXEC, 0o600)
    os.posix_fallocate(fd, 0, memory_bytes or size)
    os.truncate(fd, size)
    segment = Segment(layout, fd, size, writable=True)
    incarnation = secrets.randbits(64) or 1
    fields = {
        "magic": layout.constants["magic"],
        "layoutMajor": layout.constants["layoutMajor"],
        "layoutMinor": layout.constants["layoutMinor"],
        "kind": layout.kinds[kind],
        "totalBytes": size,
        "incarnation": incarnation,
        "ownerWindow": incarnation,
        "ownerPid": os.getpid(),
        "ownerUid": os.getuid(),
        "ownerStartTicks": start_ticks(),
        "pidNamespace": os.stat("/proc/self/ns/pid").st_ino,
        "createdMonotonicNs": time.monotonic_ns(),
        "createdRealtimeNs": time.time_ns(),
        "backplane": backplane.encode(),
        "program": f"layout-{layout.constants['layoutMajor']}.{layout.constants['layoutMinor']}".encode(),
    } | fields
    header = segment.view("SegmentHeader")
    for field, value in fields.items():
        header[field] = value
    return segment


def open_segment(layout, kind, name, writable):
    """Maps somebody else's segment. Raises FileNotFoundError, or Refused with what is wrong with it."""
    checked = reader.Segment(layout, name)
    try:
        if checked.header["kind"] != layout.kinds[kind]:
            raise reader.Refused(f"{name}: not of kind {kind}")
        fd = os.open(f"/proc/self/fd/{checked.fd}", (os.O_RDWR if writable else os.O_RDONLY) | os.O_CLOEXEC)
        segment = Segment(layout, fd, checked.header["totalBytes"], writable)
        segment.name = name
        return segment
    finally:
        checked.close()


def remove(name):
    """Whether there was one."""
    try:
        os.unlink(os.path.join(reader.DIRECTORY, name))
        return True
    except FileNotFoundError:
        return False


def start_ticks():
    with open("/proc/self/stat", encoding="utf-8", errors="replace") as file:
        return int(file.read().rpartition(")")[2].split()[22 - 3])


def encode_server(server):
    return re.sub(rb"[^A-Za-z0-9_\[\]-]", lambda byte: b"%%%02X" % byte[0][0], server.encode()).decode()
