// SPDX-License-Identifier: MIT
// A library to preload: the look-up of a name that ends with ".held" waits until somebody has opened the FIFO $MPF_TEST_HELD_LOOKUP for writing,
// and closed it again. Then, as for all others, the host is asked.
#include <fcntl.h>
#include <netdb.h>
#include <unistd.h>

#include <cstdlib>
#include <dlfcn.h>
#include <string_view>

extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** found) {
  if (name != nullptr && std::string_view(name).ends_with(".held")) {
    const int fifo = ::open(std::getenv("MPF_TEST_HELD_LOOKUP"), O_RDONLY | O_CLOEXEC);
    char byte = 0;
    while (fifo >= 0 && ::read(fifo, &byte, 1) == 1) {
    }
    ::close(fifo);
  }
  const auto host = reinterpret_cast<decltype(&getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return host(name, service, hints, found);
}
