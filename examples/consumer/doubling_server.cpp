// SPDX-License-Identifier: MIT
// doubling_server: answers each Int32 message with twice its value, until SIGTERM or SIGINT.
#include <mpf/message_server.h>

int main() {
  mpf::MessageServer server(mpf::Backplane::attach(), "doubler");
  server.on<mpf::Int32>([](mpf::Int32& request) { request.value *= 2; });
  return server.runUntilSignal();
}
