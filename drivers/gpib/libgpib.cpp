// SPDX-License-Identifier: MIT
#include "drivers/gpib/libgpib.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <stdexcept>

namespace mpf {
namespace {

template <class Function>
void findFunction(void* handle, const std::string& library, const char* name, Function*& function) {
  function = reinterpret_cast<Function*>(::dlsym(handle, name));
  if (function == nullptr)
    throw std::runtime_error(fmt::format(
        "load {}: it has no function {}; install Linux GPIB 4 or newer", library, name));
}

}  // namespace

void LibGpib::Close::operator()(void* handle) const noexcept { ::dlclose(handle); }

LibGpib::LibGpib(const std::string& library) : handle_(::dlopen(library.c_str(), RTLD_NOW)) {
  if (!handle_)
    throw std::runtime_error(fmt::format(
        "load {}: {}; install the library of Linux GPIB, or use another kind of controller",
        library, ::dlerror()));
  const auto load = [&](const char* name, auto*& function) {
    findFunction(handle_.get(), library, name, function);
  };
  load("ibask", ask);
  load("ibcmd", command);
  load("ibwrt", write);
  load("ibrd", read);
  load("ibsic", interfaceClear);
  load("ibsre", remoteEnable);
  load("iblines", lines);
  load("ibtmo", setTimeout);
  load("ibeos", setEndOfString);
  load("ibeot", setEnd);
  load("ThreadIberr", error);
  load("ThreadIbcntl", count);
}

}  // namespace mpf
