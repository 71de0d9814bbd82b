# SPDX-License-Identifier: MIT
"""Messages: the bodies of some types, as programs of layout 1.0 build and read them. Each begins with timeout, cmd, status, address, extra."""
import struct

INT32, FLOAT64, FLOAT64_ARRAY, REQUEST_FATE = 2, 4, 5, 9
REFUSED, EXPIRED = 0, 3


def int32(value):
    return struct.pack("=5ii", 0, 0, 0, 0, 0, value)


def float64(value):
    return struct.pack("=5iId", 0, 0, 0, 0, 0, 0, value)


def float64_array(values):
    return struct.pack(f"=5iI{len(values)}d", 0, 0, 0, 0, 0, len(values), *values)


def request_fate(fate, request_id):
    return struct.pack("=iI", fate, request_id)


def value(message):
    """Of a number or an array; of a fate, which and whose."""
    if message.type == INT32:
        return struct.unpack_from("=i", message.body, 20)[0]
    if message.type == FLOAT64:
        return struct.unpack_from("=d", message.body, 24)[0]
    if message.type == FLOAT64_ARRAY:
        return struct.unpack_from(f"={(len(message.body) - 24) // 8}d", message.body, 24)
    if message.type == REQUEST_FATE:
        return struct.unpack_from("=iI", message.body, 0)
    return message.body
