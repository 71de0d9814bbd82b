#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""versions_test LAYOUT TRAFFIC VICTIM MPF: today's layout holds what the older one had; a later
minor version is used, another major one refused."""

import json
import re
import unittest

import messages
import reader
from interop import CODE, LAYOUT, MPF, VICTIM, Interop


class Frozen(unittest.TestCase):
    """What today's code has where the older layout had it."""

    def setUp(self):
        self.layout = reader.Layout(LAYOUT)

    def test_constants_are_as_they_were_and_the_minor_version_has_grown_at_most(self):
        was, now = dict(self.layout.constants), {
            name: CODE["constants"].get(name) for name in self.layout.constants
        }
        self.assertGreaterEqual(now.pop("layoutMinor"), was.pop("layoutMinor"))
        self.assertEqual(now, was)

    def test_kinds_are_as_they_were(self):
        today = {kind: CODE["kinds"].get(kind) for kind in self.layout.kinds}
        self.assertEqual(today, self.layout.kinds)

    def test_fields_are_where_they_were(self):
        for name, fields in self.layout.structs.items():
            was = {
                field: [offset, self.layout.sizes[name][field]]
                for field, (offset, _) in fields.items()
                if not field.startswith("reserved")
            }
            now = {field: CODE["structs"][name]["fields"].get(field) for field in was}
            self.assertEqual(now, was, name)

    def test_structs_are_as_long_as_they_were(self):
        self.assertEqual(
            {name: CODE["structs"][name]["bytes"] for name in self.layout.bytes}, self.layout.bytes
        )


class Versions(Interop):
    NEWEST = CODE["constants"]["layoutMajor"]

    def other(self, **constants):
        layout = reader.Layout(LAYOUT)
        layout.constants |= constants
        return layout

    def later_minor(self):
        self.layout = self.other(layoutMinor=CODE["constants"]["layoutMinor"] + 1)
        return {"reserved": b"\xff" * 200}

    def fill_reserved(self, party):
        for i in range(self.layout.sizes["WindowControl"]["reserved"] // 8):
            party.window.control["reserved", i] = ~0

    def test_a_server_of_a_later_minor_version_is_used(self):
        party = self.old_server(**self.later_minor())
        self.fill_reserved(party)

        answer = json.loads(
            self.call(
                "float64Array",
                "value=" + ",".join("1" * 500),
                "--count",
                "4",
                "--json",
                parties=[party],
            )
        )

        self.assertEqual((answer["replied"], answer["failed"]), (4, 0))

    def test_a_client_of_a_later_minor_version_is_served(self):
        self.todays_server()
        more = self.later_minor()
        party = self.old_client(**more)
        self.fill_reserved(party)

        connection = self.connected(party, **more)

        self.assertEqual(
            len(
                self.ask(
                    party, connection, messages.FLOAT64_ARRAY, messages.float64_array([0] * 500)
                )
            ),
            500,
        )

    def test_todays_programs_refuse_a_living_server_of_another_major_version_by_both_numbers(self):
        for major in (0, self.NEWEST + 1):
            party = self.old_server(self.other(layoutMajor=major))
            refusal = (
                f"s.0.echo: layout version {major}; this program supports (\\d+ to )?{self.NEWEST};"
            )
            self.assertRegex(self.call("int32", "value=1", "--timeout", "1"), refusal)
            self.assertRegex(
                " ".join(self.program(MPF, "ls", "--backplane", self.backplane).rest().split()),
                f"problem: .*{refusal}",
            )
            self.assertRegex(
                self.program(VICTIM, "serve", self.backplane).rest(),
                f"another program uses a file that is not a usable segment: .*{refusal}",
            )
            names = self.names()
            self.program(MPF, "clean", "--backplane", self.backplane).rest()
            self.assertEqual(self.names(), names)
            party.close()

    def test_old_programs_refuse_todays_server_by_both_numbers(self):
        self.todays_server()
        self.layout = self.other(layoutMajor=self.NEWEST + 1)
        party = self.old_client()

        with self.assertRaisesRegex(
            reader.Refused,
            re.escape(f"s.0.echo: layout {self.NEWEST}, this program speaks {self.NEWEST + 1}"),
        ):
            party.connect("echo")

    def test_a_link_of_another_major_version_costs_its_client_alone(self):
        self.todays_server()
        party = self.old_client()
        refused = party.connect("echo", layoutMajor=self.NEWEST + 1)

        connection = self.connected(party)
        self.assertEqual(self.ask(party, connection, messages.INT32, messages.int32(1)), 1)

        self.assertFalse(refused.is_open)
        self.assertGreaterEqual(connection.link.peer.control["protocolErrors"], 1)


if __name__ == "__main__":
    unittest.main()
