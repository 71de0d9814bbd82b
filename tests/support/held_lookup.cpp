// SPDX-License-Identifier: MIT
// A library to preload: the look-up of a name that ends with ".held" waits until a process opens
// the FIFO $MPF_TEST_HELD_LOOKUP for writing and closes it or writes a byte. Then it looks up the
// name without ".held".
#include <fcntl.h>
#include <netdb.h>
#include <unistd.h>

#include <cstdlib>
#include <dlfcn.h>
#include <string>
#include <string_view>

extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints,
                           addrinfo** found) {
  if (name != nullptr && std::string_view(name).ends_with(".held")) {
    static thread_local std::string asked;
    asked = std::string_view(name).substr(
        0, std::string_view(name).size() - std::string_view(".held").size());
    const int fifo = ::open(std::getenv("MPF_TEST_HELD_LOOKUP"), O_RDONLY | O_CLOEXEC);
    char byte = 0;
    static_cast<void>(::read(fifo, &byte, 1));
    ::close(fifo);
    name = asked.c_str();
  }
  const auto host = reinterpret_cast<decltype(&getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return host(name, service, hints, found);
}
