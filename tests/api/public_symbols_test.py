#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""public_symbols_test.py TOP: the public symbols of include/mpf/ are those of
tests/api/public_symbols.txt.

A symbol in the list is a promise to other people's programs. After an intended change:
public_symbols_test.py TOP --write
"""

import difflib
import json
import os
import subprocess
import sys

HIDDEN = ("private", "protected")


def symbols(top):
    """Lines "header: kind scope::name" of all that a program may name."""
    command = [
        "ctags",
        "--languages=C++",
        "--map-C++=+.h",
        "--kinds-C++=cdefgmnpstuv",
        "--fields=+a",
        "--output-format=json",
        "-f",
        "-",
        "--recurse",
        "include/mpf",
    ]
    found = set()
    for line in subprocess.run(
        command, cwd=top, check=True, capture_output=True, text=True
    ).stdout.splitlines():
        tag = json.loads(line)
        if (
            tag.get("access") in HIDDEN
            or tag["name"].startswith("__anon")
            or tag["kind"] == "namespace"
        ):
            continue
        scope = tag.get("scope", "")
        header = tag["path"].removeprefix("include/mpf/")
        found.add(f"{header}: {tag['kind']} {scope}{'::' if scope else ''}{tag['name']}")
    return sorted(found)


def main():
    top = sys.argv[1]
    path = os.path.join(top, "tests/api/public_symbols.txt")
    now = [line + "\n" for line in symbols(top)]
    if "--write" in sys.argv[2:]:
        with open(path, "w", encoding="utf-8") as file:
            file.writelines(now)
        return 0
    with open(path, encoding="utf-8") as file:
        difference = list(difflib.unified_diff(list(file), now, "promised", "include/mpf", n=0))
    sys.stdout.writelines(difference)
    if difference:
        print(
            f"The public API has changed. If that is intended: "
            f"{os.path.relpath(__file__)} . --write"
        )
    return 1 if difference else 0


if __name__ == "__main__":
    sys.exit(main())
