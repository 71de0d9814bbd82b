# SPDX-License-Identifier: MIT
"""Interop: a backplane for programs of an older layout and today's.
Arguments: LAYOUT TRAFFIC VICTIM MPF.

The folder of LAYOUT, on PYTHONPATH, plays the old programs; the others are today's.
"""

import json
import os
import secrets
import signal
import subprocess
import sys
import unittest

import client
import doorbell
import memory
import messages
import pending_bind
import reader
import server
from party import run_until

LAYOUT, TRAFFIC, VICTIM, MPF = (sys.argv.pop(1) for _ in range(4))
WATCHDOG_SECONDS = 900
CODE = json.loads(subprocess.run([TRAFFIC, "layout"], check=True, capture_output=True).stdout)


class PatientLibc:
    """libc, but inotify_init1() waits while the user has no inotify instance left: tests beside
    this one have some."""

    def __getattr__(self, name):
        return getattr(memory.libc, name)

    def inotify_init1(self, flags):
        while (instance := memory.libc.inotify_init1(flags)) < 0:
            os.sched_yield()
        return instance


pending_bind.libc = PatientLibc()


class Program:
    """One of today's programs, and the lines that it says."""

    def __init__(self, *command):
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=False
        )
        self.output = self.process.stdout.fileno()
        os.set_blocking(self.output, False)
        self.said, self.has_ended = b"", False

    def read(self):
        while not self.has_ended:
            try:
                part = os.read(self.output, 4096)
            except BlockingIOError:
                return
            self.said += part
            self.has_ended = not part

    def is_heard(self, enough):
        self.read()
        return enough(self.said) or self.has_ended

    def line(self, *parties):
        """Its next line; the parties work meanwhile."""
        run_until(lambda: self.is_heard(lambda said: b"\n" in said), *parties, files=[self.output])
        line, _, self.said = self.said.partition(b"\n")
        return line.decode()

    def rest(self, *parties):
        """All that it says until its end; the parties work meanwhile."""
        run_until(lambda: self.is_heard(lambda said: False), *parties, files=[self.output])
        return self.said.decode()

    def end(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        self.process.wait()
        self.process.stdout.close()


SLEEPS = {doorbell.ON_BELL: doorbell.sleep_on_bell, doorbell.ON_PIPE: doorbell.sleep_on_pipes}


def state(pid):
    with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
        return file.read().rpartition(")")[2].split()[0]


class Hang(Exception):
    pass


def bark(*_):
    raise Hang


class Interop(unittest.TestCase):
    """A backplane on which nothing may be left."""

    def setUp(self):
        self.layout = reader.Layout(LAYOUT)
        self.backplane = f"layout-{secrets.token_hex(8)}"
        doorbell.nudge_seconds = None  # no wake-up gets lost here
        signal.signal(signal.SIGALRM, bark)
        signal.alarm(WATCHDOG_SECONDS)
        self.addCleanup(self.check_nothing_is_left)

    def check_nothing_is_left(self):
        signal.alarm(0)
        left = self.names()
        for name in left:
            memory.remove(name)
        self.assertEqual(left, [])

    def names(self):
        return sorted(
            name
            for name in os.listdir(reader.DIRECTORY)
            if name.startswith(f"mpf.{self.backplane}.")
        )

    def program(self, *command, end=signal.SIGTERM):
        program = Program(*command)
        self.addCleanup(program.end, end)
        return program

    def todays_server(self):
        program = Program(VICTIM, "serve", self.backplane)
        self.addCleanup(lambda: program.process.returncode is None and program.end())
        self.assertEqual(program.line(), "open")
        first = self.old_client()
        self.ask(
            first, self.connected(first), messages.FLOAT64, messages.float64(0)
        )  # now it minds signals
        first.close()
        return program

    def crowd(self, clients, *parties):
        """Today's clients of the server "echo", which say "answered" and its incarnation once
        all of them have had all replies."""
        self.addCleanup(
            subprocess.run, [TRAFFIC, "clean", self.backplane], check=True, capture_output=True
        )
        program = self.program(VICTIM, "crowd", self.backplane, str(clients), end=signal.SIGKILL)
        self.assertRegex(program.line(*parties), "^waiting:")
        return program

    def call(self, *words, parties=()):
        patience = () if "--timeout" in words else ("--timeout", "600")
        program = self.program(
            MPF, "call", "echo", *words, *patience, "--backplane", self.backplane
        )
        return program.rest(*parties)

    def old_client(self, **fields):
        party = client.Client(self.layout, self.backplane, "old", **fields)
        self.addCleanup(lambda: party.is_closed or party.close())
        return party

    def old_server(self, layout=None, **fields):
        party = server.Server(layout or self.layout, self.backplane, "echo", **fields)
        self.addCleanup(lambda: party.is_closed or party.close())
        return party

    def connected(self, party, *others, **fields):
        connection = party.connect("echo", **fields)
        run_until(lambda: connection.is_open, party, *others)
        return connection

    def ask(self, party, connection, kind, body, *others, **how):
        """The next message that comes back."""
        had = len(connection.received)
        connection.send(kind, body, clientType=-had, clientExtra=had)
        run_until(lambda: len(connection.received) > had, party, *others, **how)
        reply = connection.received[-1]
        self.assertEqual(
            (reply.clientType, reply.clientExtra, reply.requestId), (-had, had, connection.last_id)
        )
        return messages.value(reply)

    def stop_until_asleep(self, program, party, how):
        """Stops one of today's programs until the party sleeps in that way: what it
        does then has to wake it."""
        today = program.process.pid
        os.kill(today, signal.SIGSTOP)
        os.waitpid(today, os.WUNTRACED)
        watch = os.fork()
        if watch == 0:
            try:
                signal.alarm(WATCHDOG_SECONDS)
                while party.window.control["sleeping"] != how or state(os.getppid()) != "S":
                    os.sched_yield()
            finally:
                os.kill(today, signal.SIGCONT)
                os._exit(0)
        self.addCleanup(os.waitpid, watch, 0)

    def assert_answers(self, crowd, window, *parties):
        self.assertEqual(crowd.line(*parties), f"answered {window:x}")

    def incarnation(self):
        """Of the server "echo" that is there now."""
        return reader.Segment(self.layout, f"mpf.{self.backplane}.s.0.echo").header["incarnation"]
