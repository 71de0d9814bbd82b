// SPDX-License-Identifier: MIT
#include <mpf/server/programs/echo_server.h>

int main(int argc, char** argv) { return mpf::runEchoServer<mpf::Int32>(argc, argv, {"mpf-int32-server", "Int32", "Int32 message"}); }
