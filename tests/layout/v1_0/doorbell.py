# SPDX-License-Identifier: MIT
"""Doorbell: atomic changes of words that many write, and how an owner sleeps and is woken.

FUTEX_WAKE_OP changes a word and wakes who sleeps on it in one system call: the only atomic change that Python can reach, and a full fence.
"""
import ctypes
import os
import select
import stat

import reader
from memory import libc

SYS_FUTEX, SYS_MEMBARRIER = 202, 324  # x86-64
FUTEX_WAIT, FUTEX_WAKE_OP = 0, 5
ADD, OR, AND_NOT = 1, 2, 3
GLOBAL_EXPEDITED = 2
SHIFTED = 8  # the operand is the number of a bit

AWAKE, ON_BELL, ON_PIPE = 0, 1, 2
nudge_seconds = 1  # a sleeper looks again after so long: hints may get lost. None: never, for who wants to know that none does


def change(address, operation, operand):
    """Changes a 32-bit word and wakes one who sleeps on it."""
    word = ctypes.c_void_p(address)
    if libc.syscall(SYS_FUTEX, word, FUTEX_WAKE_OP, 1, ctypes.c_long(0), word, ctypes.c_long(operation << 28 | operand << 12)) < 0:
        raise OSError(ctypes.get_errno(), "FUTEX_WAKE_OP")


def set_bit(address, bit):
    """Of a 64-bit word in two halves, the lower one first, as on every little-endian host."""
    change(address + bit // 32 * 4, SHIFTED | OR, bit % 32)


def clear_bit(address, bit):
    change(address + bit // 32 * 4, SHIFTED | AND_NOT, bit % 32)


def ring(bell):
    change(bell, ADD, 1)


_anywhere = ctypes.c_uint32()


def fence():
    """Our stores before it, our loads after it."""
    change(ctypes.addressof(_anywhere), ADD, 0)


def fence_in_all_processes():
    """The same for the threads of every process that has registered for it."""
    if libc.syscall(SYS_MEMBARRIER, GLOBAL_EXPEDITED, 0, 0) < 0:
        raise OSError(ctypes.get_errno(), "membarrier")


def ring_pipe(name):
    """Writes to the pipe of that name; its owner may be gone."""
    try:  # for both directions: no SIGPIPE
        pipe = os.open(os.path.join(reader.DIRECTORY, name), os.O_RDWR | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
    except FileNotFoundError:
        return
    try:
        if stat.S_ISFIFO(os.fstat(pipe).st_mode):
            os.write(pipe, b"\1")
    except BlockingIOError:
        pass  # full: it is readable already
    finally:
        os.close(pipe)


def sleep_on_pipes(parties, files):
    """Until one of the parties is rung or one of the files is readable. False: for nothing."""
    for party in parties:
        party.window.announce(ON_PIPE)
    news = any(party.has_news() for party in parties)
    if not news:
        poll = select.poll()
        for file in [*(party.window.pipe for party in parties), *files]:
            poll.register(file, select.POLLIN)
        news = bool(poll.poll(nudge_seconds and 1000 * nudge_seconds))
    for party in parties:
        party.window.withdraw()
    return news


def sleep_on_bell(parties, files):
    """The same of one party, which waits for no file."""
    assert len(parties) == 1 and not files
    party = parties[0]
    bell = party.window.hints.word("bell")
    seen = bell.value
    party.window.announce(ON_BELL)
    news = party.has_news()
    if not news:
        until = nudge_seconds and (ctypes.c_long * 2)(nudge_seconds, 0)
        news = libc.syscall(SYS_FUTEX, ctypes.c_void_p(ctypes.addressof(bell)), FUTEX_WAIT, ctypes.c_long(seen), until, None, 0) == 0
    party.window.withdraw()
    return news
