#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""scripts/speed-tables: replaces the tables of a document, and rejects unknown names of tables.

Usage: speed_tables_test.py SCRIPT
"""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = sys.argv.pop(1)
DOCUMENT = """Before.

<!-- table readme -->
| an old table |
|---|
| 1 |

Behind.
"""


def row(question, name, mode, disturbed=False, **measured):
    return {"question": question, "name": name, "mode": mode, "disturbed": disturbed, **measured}


class SpeedTables(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = Path(kept.name)
        self.document = self.folder / "speed.md"
        self.document.write_text(DOCUMENT)

    def write(self, *rows):
        (self.folder / "local.json").write_text(json.dumps(rows))
        return subprocess.run(
            [sys.executable, "-B", SCRIPT, self.folder, self.document],
            capture_output=True, text=True, check=False,
        )

    def line(self, label):
        text = self.document.read_text()
        return next(line for line in text.split("\n") if line.startswith(f"| {label} |"))

    def test_replaces_a_table(self):
        self.assertEqual(self.write(
            row("Round trip of 4 B", "MPF", "spin", typical_ns=189.4, p50_ns=180),
            row("Round trip of 4 B", "Aeron (C)", "spin", disturbed=True, typical_ns=1536.2),
            row("Round trip of 4 B", "Unix socket", "spin", error="it has crashed"),
            row("Round trip of 4 B", "iceoryx2", "spin", skipped="it is not installed"),
            row("One way, 4 B", "MPF", "spin", per_s=43_210_000),
            row("One way, 4 B", "iceoryx2 pub-sub", "spin", per_s=565_400),
            row("Round trip of 1 MiB, untouched", "MPF", "spin", disturbed=True, typical_ns=421),
        ).returncode, 0)

        text = self.document.read_text()
        self.assertTrue(text.startswith("Before.\n\n<!-- table readme -->\n| | MPF | Aeron C |"))
        self.assertTrue(text.endswith("|\n\nBehind.\n"))
        self.assertNotIn("an old table", text)
        self.assertEqual(self.line("Int32"), "| Int32 | 189 ns | 1.54 us* | - | - | - |")
        self.assertEqual(self.line("Int32, one way"),
                         "| Int32, one way | 43.2 M/s | - | 565 k/s | - | - |")
        self.assertEqual(self.line("1 MiB, untouched*"),
                         "| 1 MiB, untouched* | 421 ns | - | - | - | - |")
        self.assertEqual(self.line("Int32, asleep"), "| Int32, asleep | - | - | - | - | - |")

    def test_rejects_an_unknown_table(self):
        self.document.write_text(DOCUMENT.replace("readme", "peer"))
        done = self.write()
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("speed.md: no table peer: use one of peers,", done.stderr)
        self.assertIn("an old table", self.document.read_text())

    def test_names_a_benchmark_that_was_not_run(self):
        self.document.write_text(DOCUMENT.replace("readme", "between hosts"))
        self.assertIn("run `make bench BENCH=remote`", self.write().stderr)

    def test_rejects_a_document_without_tables(self):
        self.document.write_text("Nothing.\n")
        self.assertIn("speed.md: has no line <!-- table NAME -->", self.write().stderr)


if __name__ == "__main__":
    unittest.main()
