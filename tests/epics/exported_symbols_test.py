#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""exported_symbols_test LIBRARY: libmpfEpics.so exports no function that a program with its own
copy of the client library defines, too: the dynamic linker would let one copy call functions of the
other. It exports device support."""
import re
import subprocess
import sys

# Functions of public classes, and instances of templates of std for them, by their mangled names.
SHARED = re.compile(r"_ZN?K?(St.*)?N?3mpf(\d+(Message|Dispatcher|Backplane|SyncClient)[A-Z]?)")

listed = subprocess.run(
    ["nm", "--dynamic", "--defined-only", sys.argv[1]], check=True, capture_output=True, text=True
).stdout
names = [line.split()[-1] for line in listed.splitlines()]
shared = [name for name in names if SHARED.match(name)]
for name in shared:
    print(f"{sys.argv[1]} exports {name}")
has_device_support = any(name.startswith("pvar_dset_") for name in names)
if not has_device_support:
    print(f"{sys.argv[1]} exports no device support")
sys.exit(1 if shared or not has_device_support else 0)
