#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""units_test CMAKE BUILD: what `cmake --install` makes of the router's systemd units, and what systemd says of it.

Exits 77, which ctest shows as skipped, where there is no systemd-analyze.
"""
import os
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77


def install(cmake, build, prefix):
    """The units alone: their folder has an install script of its own."""
    script = os.path.join(build, "router", "systemd", "cmake_install.cmake")
    subprocess.run([cmake, f"-DCMAKE_INSTALL_PREFIX={prefix}", "-P", script], check=True, stdout=subprocess.DEVNULL)


def stand_in(prefix):
    """systemd-analyze asks whether the program is there."""
    program = os.path.join(prefix, "bin", "mpf-router")
    os.makedirs(os.path.dirname(program))
    shutil.copy("/bin/true", program)
    return program


def complaints(unit):
    verified = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True)
    said = verified.stdout + verified.stderr
    return said or (f"exit status {verified.returncode}" if verified.returncode else "")


def check(unit, program, configuration):
    with open(unit, encoding="utf-8") as file:
        text = file.read()
    found = [f"{unit}: {part} is not in it" for part in ("Type=notify", "User=mpf", f"ExecStart={program} {configuration}\n") if part not in text]
    found += [f"{unit}: {part} is left" for part in ("@MPF",) if part in text]
    if said := complaints(unit):
        found.append(said)
    return found


def main():
    cmake, build = sys.argv[1:]
    if not shutil.which("systemd-analyze"):
        print("no systemd-analyze on this host")
        return SKIPPED
    with tempfile.TemporaryDirectory() as prefix:
        install(cmake, build, prefix)
        program = stand_in(prefix)
        units = os.path.join(prefix, "lib", "systemd", "system")
        found = check(os.path.join(units, "mpf-router.service"), program, "/etc/mpf/router.toml")
        found += check(os.path.join(units, "mpf-router@.service"), program, "/etc/mpf/%i.toml")
        if not os.path.exists(os.path.join(prefix, "lib", "sysusers.d", "mpf.conf")):
            found.append("no lib/sysusers.d/mpf.conf")
    print("\n".join(found) or "two units, nothing to complain about")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
