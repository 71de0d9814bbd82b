#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Each rule of check_sources reports an invalid sample, at its line, and accepts a valid one."""
import unittest

import check_sources as check

SPDX = "// SPDX-License-Identifier: MIT\n"
ACQUIRE = "a.load(std::memory_order_acquire);\n"
UNFINISHED = "TO" + "DO"  # in two parts, so that this file is accepted


class Rules(unittest.TestCase):
    def refuses(self, rule, files, *places):
        """`rule` complains at exactly these (path, line)."""
        self.assertEqual([(path, line) for path, line, _ in rule(files)], list(places))

    def passes(self, rule, files):
        self.refuses(rule, files)

    def test_every_rule_has_a_test(self):
        tested = " ".join(name for name in dir(self) if name.startswith("test_"))
        for rule in check.RULES:
            self.assertIn(f"test_{rule.__name__}", tested)

    def test_include_directions(self):
        rule = check.include_directions
        self.refuses(rule, {"shm/ring.h": SPDX + "#include <mpf/message.h>\n"}, ("shm/ring.h", 2))
        self.refuses(rule, {"client/c.cpp": '#include "server/server.h"\n'}, ("client/c.cpp", 1))
        self.refuses(rule, {"client/c.cpp": '#include "mpf/message.h"\n'}, ("client/c.cpp", 1))
        self.refuses(
            rule, {"server/s.cpp": '#include "drivers/serial/port.h"\n'}, ("server/s.cpp", 1)
        )
        self.refuses(
            rule,
            {"server/s.cpp": "#include <mpf/drivers/serial/serial_port.h>\n"},
            ("server/s.cpp", 1),
        )
        self.refuses(
            rule, {"server/s.cpp": '#include "server/programs/options.h"\n'}, ("server/s.cpp", 1)
        )
        self.refuses(
            rule, {"drivers/serial/p.cpp": '#  include "shm/ring.h"\n'}, ("drivers/serial/p.cpp", 1)
        )
        self.refuses(
            rule,
            {"include/mpf/message.h": '#include "base/printable.h"\n'},
            ("include/mpf/message.h", 1),
        )
        self.refuses(
            rule,
            {"include/mpf/message.h": "#include <mpf/message_client.h>\n"},
            ("include/mpf/message.h", 1),
        )
        self.refuses(rule, {"shm/ring.h": '#include "../base/clock.h"\n'}, ("shm/ring.h", 1))
        self.refuses(rule, {"shm/ring.h": "#include <mpf/attic.h>\n"}, ("shm/ring.h", 1))
        self.passes(
            rule,
            {"client/c.cpp": '#include <mpf/clock.h>\n#include "client/c.h"\n#include <vector>\n'},
        )
        self.passes(
            rule,
            {
                "server/programs/p.cpp": '#include "drivers/serial/port.h"\n'
                "#include <mpf/message_server.h>\n"
            },
        )
        self.passes(rule, {"tests/shm/t.cpp": '#include "server/s.h"\n'})

    def test_pairs(self):
        self.refuses(check.pairs, {"shm/a.h": "\n// PAIR(slot-filled): why\n"}, ("shm/a.h", 2))
        acquires = "// PAIR(slot-filled): why\n" + ACQUIRE
        self.refuses(check.pairs, {"shm/a.h": acquires, "shm/b.h": acquires}, ("shm/a.h", 1))
        self.passes(
            check.pairs, {"shm/a.h": acquires, "shm/b.h": acquires.replace("acquire", "release")}
        )

    def test_ordered_accesses(self):
        rule = check.ordered_accesses
        self.refuses(rule, {"shm/a.h": ACQUIRE}, ("shm/a.h", 1))
        self.refuses(rule, {"shm/a.h": "// PAIR(x)\n\n\n\n" + ACQUIRE}, ("shm/a.h", 5))
        self.refuses(rule, {"shm/a.h": "a.load();\n"}, ("shm/a.h", 1))
        self.refuses(rule, {"shm/a.h": "a.store(1, std::memory_order::release);\n"}, ("shm/a.h", 1))
        self.passes(rule, {"shm/a.h": "// PAIR(x)\n\n\n" + ACQUIRE})
        self.passes(
            rule, {"shm/a.h": "a.load(std::memory_order_relaxed);  // not memory_order_acquire\n"}
        )

    def test_licences(self):
        self.refuses(check.licences, {"shm/a.h": "#pragma once\n" + SPDX}, ("shm/a.h", 1))
        self.refuses(
            check.licences, {"examples/demo/run": "#!/bin/sh\ntrue\n"}, ("examples/demo/run", 1)
        )
        self.passes(
            check.licences,
            {
                "shm/a.h": SPDX,
                "examples/demo/run": "#!/bin/sh\n# SPDX-License-Identifier: MIT\n",
                "README.md": "# MPF\n",
            },
        )

    def test_plain_language(self):
        rule = check.plain_language
        for line in (
            "// It shall end.",
            "fails in vain",
            "a reply that is none",
            "// for who waits",
            "the server sent nonsense",
        ):
            self.refuses(rule, {"shm/a.h": line + "\n"}, ("shm/a.h", 1))
        self.passes(
            rule, {"shm/a.h": "// The process whose window it is, and who writes it: its owner.\n"}
        )

    def test_line_lengths(self):
        rule, long = check.line_lengths, "a" * 101 + "\n"
        for path in ("shm/a.h", "shm/CMakeLists.txt", "scripts/a.cmake", "tests/a.py", "docs/a.md"):
            self.refuses(rule, {path: long}, (path, 1))
        self.refuses(rule, {"scripts/a": "#!/bin/sh\n" + long}, ("scripts/a", 2))
        self.refuses(rule, {"docs/a.md": f"```text\n{long}```\n{long}"}, ("docs/a.md", 4))
        self.passes(rule, {"shm/a.h": "a" * 100 + "\n// " + "─" * 98 + "\n"})
        self.refuses(rule, {"docs/a.md": f"| {long}"}, ("docs/a.md", 1))
        self.passes(rule, {"docs/a.md": f"```text\n{long}```\n", "LICENSE": long})
        self.passes(rule, {"tests/layout/v1_0/link.py": long})

    def test_shown_code(self):
        shown = "Look:\n\n`shm/a.h`:\n```cpp\nint a;\nint b;\n```\n"
        self.refuses(
            check.shown_code, {"docs/a.md": shown, "shm/a.h": SPDX + "int a;\n"}, ("docs/a.md", 6)
        )
        self.refuses(check.shown_code, {"docs/a.md": shown}, ("docs/a.md", 5), ("docs/a.md", 6))
        self.passes(
            check.shown_code,
            {"docs/a.md": shown + "```cpp\nint c;\n```\n", "shm/a.h": SPDX + "int b;\n\nint a;\n"},
        )

    def test_named_functions(self):
        step = "1. The client sends.\n   `RequestSender::send` in `client/request_sender.cpp`\n"
        self.refuses(
            check.named_functions,
            {"docs/a.md": step, "client/request_sender.cpp": "void RequestSender::post() {}\n"},
            ("docs/a.md", 2),
        )
        self.refuses(check.named_functions, {"docs/a.md": step}, ("docs/a.md", 2))
        self.passes(
            check.named_functions,
            {
                "docs/a.md": step,
                "client/request_sender.cpp": "SendResult RequestSender::send() {}\n",
            },
        )

    def test_named_tests(self):
        rule, document = check.named_tests, "Full: `SlotRing.RefusesPush`, `Server.State`.\n"
        schema = {"schema/wire.capnp": "struct Server {\n"}
        self.refuses(rule, {"docs/a.md": document, **schema}, ("docs/a.md", 1))
        test = {"tests/ring_test.cpp": "TEST(SlotRing, RefusesPush) {\n"}
        self.refuses(rule, {"docs/a.md": document, **test}, ("docs/a.md", 1))
        self.passes(rule, {"docs/a.md": document, **schema, **test})

    def test_mirrored_tests(self):
        rule, source = check.mirrored_tests, {"shm/a.cpp": "", "shm/main.cpp": ""}
        table = check.TESTED_ELSEWHERE
        self.refuses(rule, source, ("shm/a.cpp", 1))
        self.passes(rule, {**source, "tests/shm/a_test.cpp": ""})
        self.passes(rule, {**source, table: "shm/a.cpp: no logic, two constants\n"})
        other = {table: "shm/a.cpp: shm/b_test.cpp\n"}
        self.refuses(rule, {**source, **other}, (table, 1))
        self.passes(rule, {**source, **other, "tests/shm/b_test.cpp": ""})
        both = {"tests/shm/a_test.cpp": "", "tests/shm/b_test.cpp": ""}
        self.refuses(rule, {**source, **other, **both}, (table, 1))
        self.refuses(rule, {**other, "tests/shm/b_test.cpp": ""}, (table, 1))

    def test_sizes(self):
        self.refuses(check.sizes, {"shm/a.cpp": "\n" * 401}, ("shm/a.cpp", 401))
        self.passes(check.sizes, {"shm/a.cpp": "\n" * 400, "docs/long.md": "\n" * 900})

    def test_unfinished(self):
        self.refuses(
            check.unfinished, {"shm/a.cpp": f"\n// {UNFINISHED}: later\n"}, ("shm/a.cpp", 2)
        )
        self.passes(check.unfinished, {"shm/a.cpp": 'mkstemp("file' + "X" * 6 + '");\n'})

    def test_errors_never_throw(self):
        rule = check.errors_never_throw
        self.refuses(rule, {"tools/a.cpp": '\nfmt::print(stderr, "x");\n'}, ("tools/a.cpp", 2))
        self.refuses(rule, {"demo/a.cpp": "std::cerr << 1;\n"}, ("demo/a.cpp", 1))
        self.refuses(
            rule,
            {"router/main.cpp": "int main(int argc, char** argv) try {\n"},
            ("router/main.cpp", 1),
        )
        self.passes(
            rule,
            {
                "router/main.cpp": "int main(int argc, char** argv) {\n"
                "  return mpf::runMain(kProgram, [&] { return 0; });\n"
            },
        )
        self.passes(
            rule, {"tests/a.cpp": "std::cerr << 1;\n", "client/c.h": "//   std::cerr << why;\n"}
        )

    def test_machine_paths(self):
        rule = check.machine_paths
        self.refuses(rule, {"Makefile": "\ncd /wo" + "rk/mpf\n"}, ("Makefile", 2))
        self.refuses(
            rule, {"scripts/x": "apt http://deb.debian" + ".org/debian\n"}, ("scripts/x", 1)
        )
        self.passes(rule, {"README.md": "see framework/work/items and ${top}/work/x\n"})


if __name__ == "__main__":
    unittest.main()
