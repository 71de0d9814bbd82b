// SPDX-License-Identifier: MIT
#include "server/programs/echo_server.h"

int main(int argc, char** argv) {
  return mpf::runEchoServer(argc, argv,
                            {"mpf-char8-array-server", "Char8Array", "Char8Array message",
                             [](mpf::MessageServer& server) {
                               server.on<mpf::Char8Array>([](mpf::Char8ArrayMessage&) {});
                             }});
}
