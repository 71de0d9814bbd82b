#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""reader DOCUMENT BACKPLANE: prints as JSON what is on a backplane, as somebody reads it who has DOCUMENT (docs/shm-layout.md) alone.

Offsets, sizes, types and constants are taken from the document's tables. Reads only; needs nothing but this host's /dev/shm.
"""
import fcntl
import json
import mmap
import os
import re
import stat
import struct
import sys

DIRECTORY = "/dev/shm"
CODES = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i32": "i", "i64": "q"}


def tables(text):
    """All tables of a markdown text: (the heading above, the text between, rows as dictionaries by column)."""
    heading, between, columns, rows = "", "", None, []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if columns is None:
                columns = cells
            elif not set(line) <= set("|-: "):
                rows.append(dict(zip(columns, cells)))
            continue
        if columns is not None:
            yield heading, between, rows
            columns, rows = None, []
        if line.startswith("#"):
            heading, between = line.strip("# "), ""
        else:
            between += line + "\n"


class Layout:
    """The document's tables: constants, kinds, and structs as {name: {field: (offset, type)}}."""

    def __init__(self, document):
        with open(document, encoding="utf-8") as file:
            text = file.read()
        self.structs, self.sizes, self.bytes = {}, {}, {}
        for heading, between, rows in tables(text):
            if "constant" in rows[0]:
                self.constants = {row["constant"]: int(row["value"], 0) for row in rows}
            elif "lock" in rows[0]:
                self.kinds = {row["kind"]: int(row["value"]) for row in rows}
                self.letters = {row["name"]: row["kind"] for row in rows}
                self.locked = {row["kind"] for row in rows if row["lock"] == "yes"}
            elif "field" in rows[0]:
                self.structs[heading] = {row["field"]: (int(row["offset"]), row["type"]) for row in rows}
                self.sizes[heading] = {row["field"]: int(row["bytes"]) for row in rows}
                self.bytes[heading] = int(re.search(r"(\d+) bytes", between)[1])

    def size_of(self, kind):
        array = re.fullmatch(r"(\w+)\[(\d+)\]", kind)
        if array:
            return self.size_of(array[1]) * int(array[2]) if array[1] != "char" else int(array[2])
        if kind in CODES:
            return struct.calcsize("=" + CODES[kind])
        return self.bytes[kind]

    def read(self, data, kind, at):
        """The value of type `kind` at `at`; a struct as a dictionary."""
        array = re.fullmatch(r"(\w+)\[(\d+)\]", kind)
        if array and array[1] == "char":
            return bytes(data[at : at + int(array[2])]).split(b"\0")[0].decode("utf-8", "replace")
        if array and array[1] == "u8":
            return bytes(data[at : at + int(array[2])])
        if array:
            return list(struct.unpack_from(f"={array[2]}{CODES[array[1]]}", data, at))
        if kind in CODES:
            return struct.unpack_from("=" + CODES[kind], data, at)[0]
        return {field: self.read(data, inner, at + offset) for field, (offset, inner) in self.structs[kind].items()}


class Refused(Exception):
    pass


class Segment:
    """One file: checked, mapped for reading, and whether somebody holds its lock."""

    def __init__(self, layout, name):
        self.layout, self.name = layout, name
        path = os.path.join(DIRECTORY, name)
        self.fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
        status = os.fstat(self.fd)
        if not stat.S_ISREG(status.st_mode):
            raise Refused(f"{path}: no regular file")
        head = os.pread(self.fd, layout.size_of("SegmentHeader"), 0)
        if len(head) < layout.size_of("SegmentHeader"):
            raise Refused(f"{path}: truncated")
        self.header = layout.read(head, "SegmentHeader", 0)
        if self.header["magic"] != layout.constants["magic"]:
            raise Refused(f"{path}: foreign magic")
        if self.header["layoutMajor"] != layout.constants["layoutMajor"]:
            raise Refused(f"{path}: layout {self.header['layoutMajor']}, this program speaks {layout.constants['layoutMajor']}")
        if status.st_size < self.header["totalBytes"]:
            raise Refused(f"{path}: truncated, {status.st_size} bytes of {self.header['totalBytes']}")
        self.data = mmap.mmap(self.fd, status.st_size, mmap.MAP_SHARED, mmap.PROT_READ)

    def is_locked(self):
        # struct flock: l_type, l_whence, l_start, l_len, l_pid
        asked = struct.pack("hhqqi4x", fcntl.F_RDLCK, os.SEEK_SET, 0, 1, 0)
        try:
            answer = fcntl.fcntl(self.fd, fcntl.F_OFD_GETLK, asked)
        except OSError:
            return True
        return struct.unpack("hhqqi4x", answer)[0] != fcntl.F_UNLCK

    def close(self):
        self.data.close()
        os.close(self.fd)


def parse_name(name):
    """(kind's letter, the rest in parts) of a file name, None if it is not of this grammar."""
    match = re.fullmatch(r"mpf\.([A-Za-z0-9_-]{1,39})\.([scflbhwp])\.(.+)", name)
    if not match:
        return None
    letter, parts = match[2], match[3].split(".")
    shapes = {
        "s": [r"-?\d+", r"(?:[A-Za-z0-9_\[\]-]|%[0-9A-F]{2})+"],
        "l": ["[0-9a-f]{1,16}"] * 2,
        "b": ["[0-9a-f]{1,16}", "[01]", r"\d+"],
        "p": ["[0-9a-f]{1,16}", r"\d+"],
    }
    shape = shapes.get(letter, ["[0-9a-f]{1,16}"])
    if len(parts) != len(shape) or not all(re.fullmatch(one, part) for one, part in zip(shape, parts)):
        return None
    return letter, parts


def decode_server(encoded):
    return re.sub(rb"%([0-9A-F]{2})", lambda byte: bytes([int(byte[1], 16)]), encoded.encode()).decode("utf-8", "replace")


def bucket_end(i):
    return 2 ** (i // 4 + 4) + (i % 4 + 1) * 2 ** (i // 4 + 2)


def quantile(buckets, p):
    running, total = 0, sum(buckets)
    for i, count in enumerate(buckets):
        running += count
        if count and running >= p * total:
            return bucket_end(i)
    return 0


def histogram(raw):
    return {
        "count": sum(raw["buckets"]),
        "medianNs": quantile(raw["buckets"], 0.5),
        "p99Ns": quantile(raw["buckets"], 0.99),
        "highestBucketEndNs": quantile(raw["buckets"], 1),
        "maxNs": raw["maxNs"],
    }


class Backplane:
    """All segments of one backplane, by kind and incarnation."""

    def __init__(self, layout, name):
        self.layout, self.name = layout, name
        self.refused, self.segments, self.pipes = [], [], []
        for file in sorted(os.listdir(DIRECTORY)):
            parsed = parse_name(file)
            if parsed is None or not file.startswith(f"mpf.{name}."):
                continue
            if parsed[0] == "f":
                self.pipes.append(file)
                continue
            try:
                segment = Segment(layout, file)
                if segment.header["kind"] != layout.kinds[layout.letters[parsed[0]]]:
                    raise Refused(f"{file}: of another kind than its name says")
            except FileNotFoundError:
                continue
            except Refused as why:
                self.refused.append(str(why))
                continue
            segment.parts = parsed[1]
            self.segments.append(segment)

    def of(self, *kinds):
        values = [self.layout.kinds[kind] for kind in kinds]
        return [segment for segment in self.segments if segment.header["kind"] in values]

    def lives(self, window):
        """Whether the owner of the window with that incarnation is alive."""
        return any(one.header["incarnation"] == window and one.is_locked() for one in self.of("serverWindow", "clientWindow"))

    def window(self, segment):
        header = segment.header
        control = self.layout.read(segment.data, "WindowControl", self.layout.constants["windowControlOffset"])
        result = {key: header[key] for key in ("name", "location", "program", "ownerPid", "ownerUid", "waitMode")}
        result |= {key: value for key, value in control.items() if isinstance(value, int) and not key.startswith("reserved")}
        result["file"] = segment.name
        result["incarnation"] = f"{header['incarnation']:x}"
        result["alive"] = segment.is_locked()
        result["queueWaitNs"], result["serviceNs"] = histogram(control["queueWaitNs"]), histogram(control["serviceNs"])
        if len(segment.parts) == 2:
            result["nameOfFile"] = decode_server(segment.parts[1])
        return result

    def chunk(self, link, body):
        """The memory of a chunk: (bytes, capacity), None when there is no such chunk."""
        ref = self.layout.read(body, "ChunkRef", 0)
        name = f"mpf.{self.name}.b.{link.header['incarnation']:x}.{ref['side']}.{ref['segment']}"
        if ref["side"] == 2:
            name = f"mpf.{self.name}.p.{link.header['serverWindow']:x}.{ref['segment']}"
        for bulk in self.of("bulk", "fanOut"):
            size, count = bulk.header["chunkBytes"], bulk.header["chunkCount"]
            start = self.layout.constants["bulkChunksOffset"] + ref["chunk"] * size
            if bulk.name == name and ref["chunk"] < count and start + size <= len(bulk.data):
                return bulk.data[start : start + size]
        return None

    def messages(self, link, first_slot, slots, control, more, moved):
        """Messages in a ring from `freed` on: taken ones that were not handed back, and those that wait."""
        layout, found, position = self.layout, [], control["freed"]
        slot_bytes = layout.size_of("Slot")

        def place(at):
            first, count = (first_slot + slots, more) if moved and at >= moved - 1 else (first_slot, slots)
            return layout.constants["linkRingsOffset"] + (first + at % count) * slot_bytes

        while len(found) < slots + more:
            slot = layout.read(link.data, "Slot", place(position))
            if slot["sequence"] != position + 1:
                return found
            count = slot["slots"] if 1 <= slot["slots"] <= layout.constants["maxMessageSlots"] else 1
            body = slot["body"] + b"".join(layout.read(link.data, "MoreSlot", place(position + i))["body"] for i in range(1, count))
            message = {key: slot[key] for key in ("type", "flags", "bodyBytes", "requestId", "clientType", "clientExtra", "deadlineNs")}
            if slot["flags"] & 1:
                body = self.chunk(link, body) or b""
            message["body"] = body[: slot["bodyBytes"]].hex()
            message["position"], message["slots"] = position, count
            if layout.read(link.data, "Slot", place(position))["sequence"] == position + 1:
                found.append(message)
            position += count
        return found

    def ring(self, link, first_slot, slots, control, sent, more=0, moved=0):
        waiting = max(0, sent - control["taken"])
        messages = self.messages(link, first_slot, slots, control, more, moved)
        return control | {"sent": sent, "waiting": waiting, "waitingMessages": messages[len(messages) - waiting :] if waiting else []}

    def link(self, segment):
        header = segment.header
        control = self.layout.read(segment.data, "LinkControl", header["ringBytesOffset"])
        keys = ("name", "location", "queueSlots", "replySlots", "queueSize", "maxOutstanding", "clientIndex")
        result = {key: header[key] for key in keys}
        result |= {key: control[key] for key in ("clientState", "serverState", "serverIndex", "requestWatch", "replyWatch", "clientRefused", "clientAnswered")}
        result["file"] = segment.name
        result["clientAlive"], result["serverAlive"] = self.lives(header["clientWindow"]), self.lives(header["serverWindow"])
        result["requests"] = self.ring(segment, 0, header["queueSlots"], control["requests"], control["clientSent"])
        second = (header["moreReplySlots"], control["repliesMoved"])
        result["replies"] = self.ring(segment, header["queueSlots"], header["replySlots"], control["replies"], control["serverSent"], *second)
        return result

    def other(self, segment):
        return {"file": segment.name, "name": segment.header["name"], "location": segment.header["location"], "alive": self.lives(segment.header["ownerWindow"])}

    def look(self):
        return {
            "backplane": self.name,
            "servers": [self.window(one) for one in self.of("serverWindow")],
            "clients": [self.window(one) for one in self.of("clientWindow")],
            "links": [self.link(one) for one in self.of("link")],
            "pendingBinds": [self.other(one) for one in self.of("pendingBind")],
            "bulk": [self.other(one) for one in self.of("bulk")],
            "hints": [self.other(one) | {"locked": one.is_locked()} for one in self.of("hints")],
            "pipes": self.pipes,
            "refused": self.refused,
        }

    def close(self):
        for segment in self.segments:
            segment.close()


def look(document, backplane):
    reader = Backplane(Layout(document), backplane)
    try:
        return reader.look()
    finally:
        reader.close()


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    json.dump(look(sys.argv[1], sys.argv[2]), sys.stdout, indent=2)
    print()
