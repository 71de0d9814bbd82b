// SPDX-License-Identifier: MIT
#include "server/programs/echo_server.h"

int main(int argc, char** argv) {
  return mpf::runEchoServer(
      argc, argv, {"mpf-int32-server", "Int32", "Int32 message", [](mpf::MessageServer& server) {
                     server.on<mpf::Int32>([](mpf::Int32&) {});
                   }});
}
