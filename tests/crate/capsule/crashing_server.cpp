// SPDX-License-Identifier: MIT
// crashing_server BACKPLANE: a server "victim" that replies to each Int32 with the same value, and
// dies by SIGSEGV in the middle of a request whose cmd is 9. Prints "open" when clients can bind.
#include <signal.h>
#include <sys/resource.h>

#include <cstdio>

#include <mpf/message_server.h>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const rlimit noCore{0, 0};
  ::setrlimit(RLIMIT_CORE, &noCore);
  mpf::MessageServer server(mpf::Backplane::attach(argv[1]), "victim");
  server.on<mpf::Int32>([](mpf::Int32& request) {
    if (request.cmd == 9) ::raise(SIGSEGV);
  });
  std::puts("open");
  std::fflush(stdout);
  server.run();
  return 0;
}
