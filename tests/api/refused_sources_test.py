#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Handlers that MessageServer::on() accepts compile; mistakes do not, and the error says why. An
older standard than C++20 is named in the first error.

usage: refused_sources_test.py SOURCE_FOLDER COMPILER
"""

import os
import subprocess
import sys
import tempfile

INCLUDES = """
#include <functional>
#include <span>
#include <mpf/message_server.h>
"""

SOURCE = """
using namespace mpf;
void set(MessageServer& server) {
  %s
}
"""

FORMS = "the handler takes T&"
RESULT = "a handler returns void"
NEVER = "never requests"

REFUSED = [
    ("server.on<Int32>([](Int32 request) { request.value = 1; });", FORMS),
    ("server.on<Int32>([](const Int32&) {});", FORMS),
    ("server.on<Int32>([](Int32&&) {});", FORMS),
    ("server.on<Int32>([](const Int32Message&) {});", FORMS),
    ("server.on<Int32>([](const Message&) {});", FORMS),
    ("server.on<Int32>([](std::span<const Int32>) {});", FORMS),
    ("server.on<Int32>([](const std::span<const Int32>&) {});", FORMS),
    ("server.on<Int32>(std::function<void(Int32)>());", FORMS),
    ("server.on<Int32>(+[](Int32) noexcept {});", FORMS),
    ("server.on<Int32>([](Float64&) {});", FORMS),
    ("server.on<Int32>([] {});", FORMS),
    ("server.on<Int32Array>([](std::span<Int32>) {});", FORMS),
    ("server.on<Int32>([](Int32& request) { request.value = 1; return -1; });", RESULT),
    ("server.on<Int32>([](Int32Message&&) { return true; });", RESULT),
    ("server.on<Int32>([](std::span<Int32>) { return 0; });", RESULT),
    ("server.on<Int32>([](auto& request) { return request.value; });", RESULT),
    ("server.on<Connect>([](Connect&) {});", NEVER),
    ("server.on<RequestFate>([](RequestFate&) {});", NEVER),
]

ACCEPTED = """
  server.on<Int32>([](Int32& request) { request.value = 1; });
  server.on<Int32>([count = 0](Int32& request) mutable noexcept { request.value = ++count; });
  server.on<Int32>([](auto& request) { request.value = 1; });
  server.on<Int32>([](auto&& request) { request.value = 1; });
  server.on<Int32>([](Int32Message& request) { request->value = 1; });
  server.on<Int32>([](Int32Message&& request) { request->value = 1; });
  server.on<Int32>([](Int32Message request) { request->value = 1; });
  server.on<Int32>([](Message& request) { request.setTimeStampNs(1); });
  server.on<Int32>([](Message&& request) { request.reset(); });
  server.on<Int32>([](std::span<Int32> requests) { requests[0].value = 1; });
  server.on<Int32>(std::function<void(Int32&)>([](Int32&) {}));
  server.on<Int32>(+[](Int32&) {});
  server.on<Int32Array>([](Int32ArrayMessage& request) { request.value()[0] = 1; });
  server.on<Int32Array>([](Int32Array& request) { request.status = 1; });
  struct Both {
    void operator()(Int32& request) const { request.value = 1; }
    void operator()(std::span<Int32>) const {}
  };
  server.on<Int32>(Both());
"""


HEADERS = ["message_client.h", "message_server.h", "sync_client.h", "message_of.h", "rights.h"]


def errors_of(command, source=""):
    """What the compiler writes; empty if the source compiles."""
    done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
    return done.stderr if done.returncode != 0 else ""


def check_handlers(command, place):
    """Yields what is wrong. The headers, which take longer than a handler, are compiled once."""
    header = os.path.join(place, "headers.h")
    with open(header, "w", encoding="utf-8") as file:
        file.write(INCLUDES)
    command = [*command, "-std=c++20"]
    if errors := errors_of([*command, "-x", "c++-header", header]):
        yield "does not compile:\n" + errors
    command += ["-fsyntax-only", "-Werror=invalid-pch", "-include", header, "-x", "c++", "-"]
    if errors := errors_of(command, SOURCE % ACCEPTED):
        yield "does not compile:\n" + errors
    for source, why in REFUSED:
        errors = errors_of(command, SOURCE % source)
        if errors.count("error:") != 1 or why not in errors:
            yield f"{source}\n  is not refused with the only error: {why}\n{errors}"


def check_standard(command):
    """Yields what is wrong."""
    command = [*command, "-std=c++17", "-fsyntax-only", "-x", "c++", "-"]
    for header in HEADERS:
        errors = errors_of(command, f"#include <mpf/{header}>\n")
        first = next((line for line in errors.splitlines() if "error:" in line), "no error")
        if "MPF needs C++20" not in first:
            yield f"<mpf/{header}> with C++17: the first error is: {first}"


def main(folder, compiler):
    command = [compiler, "-I", folder + "/include"]
    with tempfile.TemporaryDirectory() as place:
        failures = [*check_handlers(command, place), *check_standard(command)]
    print("\n".join(failures) or f"{len(REFUSED) + len(HEADERS)} sources were refused")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
