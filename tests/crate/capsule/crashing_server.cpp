// SPDX-License-Identifier: MIT
// crashing_server BACKPLANE: a server "victim" that replies to each Int32 with the same value, and
// dies by SIGSEGV in the middle of a request whose cmd is 9, and at a bad address when it is 10. It
// works on a request whose cmd is 11 for ever.
// Prints "open" when clients can bind. The limit of cores is 0 unless MPF_TEST_CORES is set.
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include <mpf/message_server.h>

// A function with a name for the stack.
[[gnu::noinline]] void writeTo(std::int32_t address) {
  *reinterpret_cast<volatile char*>(std::intptr_t{address}) = 1;
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto size = std::getenv("MPF_TEST_CORES") == nullptr ? 0 : RLIM_INFINITY;
  const rlimit limit{size, size};
  ::setrlimit(RLIMIT_CORE, &limit);
  mpf::MessageServer server(mpf::Backplane::attach(argv[1]), "victim");
  server.on<mpf::Int32>([](mpf::Int32& request) {
    if (request.cmd == 9) ::raise(SIGSEGV);
    if (request.cmd == 10) writeTo(request.address);
    while (request.cmd == 11) ::pause();
  });
  std::puts("open");
  std::fflush(stdout);
  server.run();
  return 0;
}
