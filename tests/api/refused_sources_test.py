#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Handlers that MessageServer::on() accepts compile; mistakes do not, and the error says why. An
older standard than C++20 is named in the first error.

usage: refused_sources_test.py SOURCE_FOLDER COMPILER
"""

import subprocess
import sys

SOURCE = """
#include <functional>
#include <span>
#include <mpf/message_server.h>
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


def errors_of(source, folder, compiler, standard="c++20"):
    """What the compiler writes; empty if the source compiles."""
    options = ["-std=" + standard, "-fsyntax-only", "-I", folder + "/include", "-x", "c++", "-"]
    done = subprocess.run([compiler, *options], input=source, capture_output=True, text=True)
    return done.stderr if done.returncode != 0 else ""


def main(folder, compiler):
    failures = []
    if errors := errors_of(SOURCE % ACCEPTED, folder, compiler):
        failures.append("does not compile:\n" + errors)
    for source, why in REFUSED:
        errors = errors_of(SOURCE % source, folder, compiler)
        if errors.count("error:") != 1 or why not in errors:
            failures.append(f"{source}\n  is not refused with the only error: {why}\n{errors}")
    for header in HEADERS:
        errors = errors_of(f"#include <mpf/{header}>\n", folder, compiler, "c++17")
        first = next((line for line in errors.splitlines() if "error:" in line), "no error")
        if "MPF needs C++20" not in first:
            failures.append(f"<mpf/{header}> with C++17: the first error is: {first}")
    print("\n".join(failures) or f"{len(REFUSED) + len(HEADERS)} sources were refused")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
