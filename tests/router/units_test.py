#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""units_test CMAKE BUILD: installs the systemd units of routers and crates, and verifies them
with systemd-analyze.

Exits with 77, which ctest shows as skipped, on a host without systemd-analyze.
"""
import os
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77


def install(cmake, build, prefix):
    """Installs only the units, with the install scripts of their folders."""
    for folder in ("router", "crate"):
        script = os.path.join(build, folder, "systemd", "cmake_install.cmake")
        command = [cmake, f"-DCMAKE_INSTALL_PREFIX={prefix}", "-P", script]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def stand_in(prefix, name):
    """Installs a stand-in for a program: systemd-analyze checks that it exists."""
    program = os.path.join(prefix, "bin", name)
    os.makedirs(os.path.dirname(program), exist_ok=True)
    shutil.copy("/bin/true", program)
    return program


def complaints(unit):
    command = ["systemd-analyze", "verify", "--man=no", unit]
    verified = subprocess.run(command, capture_output=True, text=True)
    said = verified.stdout + verified.stderr
    return said or (f"exit status {verified.returncode}" if verified.returncode else "")


def check(unit, program, configuration):
    with open(unit, encoding="utf-8") as file:
        text = file.read()
    required = ("Type=notify", "User=mpf", f"ExecStart={program} {configuration}\n")
    found = [f"{unit}: {part} is missing" for part in required if part not in text]
    if "@MPF" in text:
        found.append(f"{unit}: @MPF has not been replaced")
    if said := complaints(unit):
        found.append(said)
    return found


def main():
    cmake, build = sys.argv[1:]
    if not shutil.which("systemd-analyze"):
        print("systemd-analyze is not installed on this host")
        return SKIPPED
    with tempfile.TemporaryDirectory() as prefix:
        install(cmake, build, prefix)
        program = stand_in(prefix, "mpf-router")
        units = os.path.join(prefix, "lib", "systemd", "system")
        found = check(os.path.join(units, "mpf-router.service"), program, "/etc/mpf/router.toml")
        found += check(os.path.join(units, "mpf-router@.service"), program, "/etc/mpf/%i.toml")
        crate = stand_in(prefix, "mpf")
        found += check(os.path.join(units, "mpf-crate@.service"), crate, "run /etc/mpf/%i.toml")
        if not os.path.exists(os.path.join(prefix, "lib", "sysusers.d", "mpf.conf")):
            found.append("lib/sysusers.d/mpf.conf is missing")
    print("\n".join(found) or "the units are valid")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
