// SPDX-License-Identifier: MIT
#include "benchmarks/epics/bench_ioc.h"

#include <dlfcn.h>
#include <filesystem>
#include <fmt/format.h>
#include <stdexcept>

#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

std::string modulePath() {
  return std::filesystem::canonical("/proc/self/exe").parent_path().parent_path() /
         "lib/mpf_bench_ioc.so";
}

}  // namespace

BenchIoc& loadBenchIoc() {
  // Global: EPICS looks for record types and device support by name.
  auto* module = ::dlopen(modulePath().c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (module == nullptr) throw std::runtime_error(::dlerror());
  const auto factory = reinterpret_cast<BenchIocFactory>(::dlsym(module, kBenchIocFactory));
  if (factory == nullptr) throw std::runtime_error(::dlerror());
  return factory();
}

std::string whyNoBenchIoc() {
  if (std::filesystem::exists(modulePath())) return {};
  return modulePath() + " does not exist: build MPF where EPICS Base is found";
}

void waitUntilValid(BenchIoc& ioc, const std::string& record) {
  const auto isIdle = [&] { return ioc.get(record + ".PACT") == "0"; };
  const auto isValid = [&] {
    ioc.put(record + ".PROC", "1");
    return waitUntil(isIdle, kConnectLimit) && ioc.get(record + ".SEVR") == "NO_ALARM";
  };
  if (!waitUntil(isValid, kConnectLimit))
    throw std::runtime_error(
        fmt::format("{}: {} {}", record, ioc.get(record + ".STAT"), ioc.get(record + ".AMSG")));
}

}  // namespace mpf::bench
