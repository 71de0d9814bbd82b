#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""second_reader_test DOCUMENT TRAFFIC: compares the document with the code, and
checks what a reader written from the document reads of TRAFFIC."""

import json
import os
import signal
import subprocess
import sys
import unittest

import reader

DOCUMENT, TRAFFIC = sys.argv.pop(1), sys.argv.pop(1)


def look(backplane):
    """What the reader sees on the backplane, with the tables of the document."""
    return reader.look(DOCUMENT, backplane)


class Document(unittest.TestCase):
    """Compares every table of the document with the code."""

    @classmethod
    def setUpClass(cls):
        cls.layout = reader.Layout(DOCUMENT)
        cls.code = json.loads(
            subprocess.run([TRAFFIC, "layout"], check=True, capture_output=True).stdout
        )

    def test_constants_are_those_of_the_code(self):
        self.assertEqual(self.layout.constants, self.code["constants"])

    def test_kinds_are_those_of_the_code(self):
        self.assertEqual(self.layout.kinds, self.code["kinds"])

    def test_every_struct_has_a_table_and_every_table_a_struct(self):
        self.assertEqual(set(self.layout.structs), set(self.code["structs"]))

    def test_every_field_is_where_the_code_has_it(self):
        for name, struct in self.code["structs"].items():
            documented = {
                field: [offset, self.layout.sizes[name][field]]
                for field, (offset, _) in self.layout.structs[name].items()
            }
            self.assertEqual(documented, struct["fields"], name)

    def test_every_type_is_as_long_as_its_field(self):
        for name, fields in self.layout.structs.items():
            for field, (_, kind) in fields.items():
                self.assertEqual(
                    self.layout.size_of(kind), self.layout.sizes[name][field], f"{name}.{field}"
                )

    def test_fields_do_not_overlap(self):
        for name, fields in self.layout.structs.items():
            ends = 0
            for offset, kind in fields.values():
                self.assertGreaterEqual(offset, ends, name)
                ends = offset + self.layout.size_of(kind)
            self.assertLessEqual(ends, self.code["structs"][name]["bytes"], name)

    def test_every_struct_is_as_long_as_in_the_code(self):
        self.assertEqual(
            self.layout.bytes,
            {name: struct["bytes"] for name, struct in self.code["structs"].items()},
        )

    def test_buckets_end_where_the_formula_says(self):
        self.assertEqual(
            [reader.bucket_end(i) for i in range(len(self.code["bucketEnds"]))],
            self.code["bucketEnds"],
        )


class Names(unittest.TestCase):
    def test_names_of_other_programs_are_refused(self):
        for name in (
            "mpf.default",
            "mpf.default.c.",
            "mpf.default.c.X",
            "mpf.default.s.0",
            "mpf.default.l.1",
            "mpf.a.b.c.1",
            "mpf..c.1",
            "notes",
        ):
            self.assertIsNone(reader.parse_name(name), name)

    def test_names_of_servers_are_decoded(self):
        letter, parts = reader.parse_name("mpf.default.s.-1.AIM1%2F1%2Ea%20b%25[0]")
        self.assertEqual(
            (letter, parts[0], reader.decode_server(parts[1])), ("s", "-1", "AIM1/1.a b%[0]")
        )


class Reader(unittest.TestCase):
    """Reads a server and a client with known traffic."""

    def setUp(self):
        self.process = subprocess.Popen(
            [TRAFFIC, "run"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.expected = self.answer()
        self.backplane = self.expected["backplane"]

    def tearDown(self):
        self.process.kill()
        self.process.communicate()
        subprocess.run([TRAFFIC, "clean", self.backplane], check=True, capture_output=True)
        left = [
            file
            for file in os.listdir(reader.DIRECTORY)
            if file.startswith(f"mpf.{self.backplane}.")
        ]
        self.assertEqual(left, [])

    def answer(self):
        return json.loads(self.process.stdout.readline())

    def serve(self):
        self.process.stdin.write("serve\n")
        self.process.stdin.flush()
        self.expected = self.answer()

    def look(self):
        seen = look(self.backplane)
        self.assertEqual(seen["refused"], [])
        self.assertEqual(
            [len(seen[kind]) for kind in ("servers", "clients", "links", "pendingBinds")],
            [1, 1, 1, 1],
        )
        return seen

    def check_fields(self, seen, **expected):
        self.assertEqual({key: seen[key] for key in expected}, expected)

    def test_windows_pending_binds_hints_and_fifos(self):
        seen, expected = self.look(), self.expected
        server, client = seen["servers"][0], seen["clients"][0]
        owner = {
            "ownerPid": expected["pid"],
            "ownerUid": expected["uid"],
            "program": expected["program"],
            "alive": True,
            "state": 1,
        }
        self.check_fields(
            server,
            name=expected["server"],
            nameOfFile=expected["server"],
            location=expected["location"],
            waitMode=2,
            **owner,
        )
        self.check_fields(client, name=expected["label"], **owner)
        self.check_fields(
            seen["pendingBinds"][0],
            name=expected["absentServer"],
            location=expected["absentLocation"],
            alive=True,
        )
        self.assertEqual([hint["locked"] for hint in seen["hints"]], [True, True])
        self.assertEqual(
            sorted(pipe.split(".")[3] for pipe in seen["pipes"]),
            sorted([server["incarnation"], client["incarnation"]]),
        )

    def test_counters_and_positions(self):
        seen, expected = self.look(), self.expected
        server, link, served = seen["servers"][0], seen["links"][0], expected["served"]
        waiting = expected["sent"] - served
        self.assertEqual(waiting, expected["queueSize"])
        self.check_fields(
            server,
            received=served,
            sent=served,
            linksOpened=1,
            linkCount=1,
            protocolErrors=0,
            peersDied=0,
        )
        self.check_fields(server, queueSize=expected["queueSize"], expired=0, refused=0)
        self.check_fields(seen["clients"][0], received=expected["replies"], linksOpened=1)
        self.check_fields(
            link,
            name=expected["server"],
            clientState=1,
            serverState=1,
            clientAlive=True,
            serverAlive=True,
        )
        self.check_fields(
            link, clientRefused=1, clientAnswered=served, queueSize=expected["queueSize"]
        )
        self.check_fields(
            link["requests"], sent=expected["sent"], taken=served, freed=served, waiting=waiting
        )
        self.check_fields(link["replies"], sent=served, taken=served, waiting=0)

    def test_requests_that_wait(self):
        seen = self.look()["links"][0]["requests"]["waitingMessages"]
        self.assertEqual(len(seen), len(self.expected["requests"]))
        for message, sent in zip(seen, self.expected["requests"]):
            self.assertEqual(sent.pop("result"), 0)
            self.check_fields(message, **sent)
        text = self.expected["text"].encode()
        self.assertIn(text, bytes.fromhex(seen[0]["body"]), "in a chunk")
        self.assertIn(text[:90], bytes.fromhex(seen[1]["body"]), "in three slots")
        self.assertEqual([message["flags"] for message in seen], [1] + [0] * 7)
        self.assertEqual([message["slots"] for message in seen], [1, 3] + [1] * 6)
        for i, message in enumerate(seen[2:], start=2):
            self.assertIn((1000 + i).to_bytes(4, sys.byteorder), bytes.fromhex(message["body"]))

    def test_histograms(self):
        server = self.look()["servers"][0]
        for name in ("queueWaitNs", "serviceNs"):
            seen = server[name]
            self.assertGreaterEqual(seen["count"], 1, name)
            self.assertLessEqual(seen["count"], server["received"], name)
            self.assertLess(seen["maxNs"], seen["highestBucketEndNs"], name)
            self.assertGreater(seen["maxNs"] * 5 // 4 + 20, seen["highestBucketEndNs"], name)
            self.assertLessEqual(seen["medianNs"], seen["p99Ns"], name)

    def test_traffic_after_the_first_look(self):
        before = self.look()
        self.serve()
        after = self.look()
        requests, replies = after["links"][0]["requests"], after["links"][0]["replies"]
        self.assertEqual(after["servers"][0]["received"], self.expected["sent"])
        self.assertGreater(after["servers"][0]["received"], before["servers"][0]["received"])
        self.check_fields(requests, waiting=0, waitingMessages=[], taken=self.expected["sent"])
        self.check_fields(
            replies, sent=self.expected["sent"], taken=self.expected["replies"], waiting=8
        )
        self.assertEqual([reply["flags"] & 2 for reply in replies["waitingMessages"]], [2] * 8)

    def test_a_stopped_process_is_read_as_a_running_one(self):
        running = self.look()
        self.process.send_signal(signal.SIGSTOP)
        os.waitpid(self.process.pid, os.WUNTRACED)
        self.assertEqual(self.look(), running)

    def test_a_killed_process_is_dead_at_once_and_its_files_can_be_read(self):
        running = self.look()
        self.process.kill()
        self.process.wait()
        dead = self.look()
        self.assertEqual(
            [dead[kind][0]["alive"] for kind in ("servers", "clients", "pendingBinds")],
            [False] * 3,
        )
        self.check_fields(dead["links"][0], clientAlive=False, serverAlive=False)
        self.assertEqual(dead["links"][0]["requests"], running["links"][0]["requests"])

    def test_other_versions_are_refused_and_both_versions_named(self):
        file = self.look()["links"][0]["file"]
        with open(os.path.join(reader.DIRECTORY, file), "r+b") as link:
            link.seek(8)
            link.write((3).to_bytes(2, sys.byteorder))
        seen = look(self.backplane)
        self.assertEqual(seen["links"], [])
        self.assertIn(f"{file}: layout 3, this program speaks 1", seen["refused"][0])
        with open(os.path.join(reader.DIRECTORY, file), "r+b") as link:
            link.seek(8)
            link.write((1).to_bytes(2, sys.byteorder))


if __name__ == "__main__":
    unittest.main()
