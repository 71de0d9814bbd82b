// SPDX-License-Identifier: MIT
#include "tests/fuzz/fuzzers.h"

#include <cstdlib>
#include <iostream>
#include <string_view>

namespace mpf::test {
namespace {

struct Fuzzer {
  std::string_view name;
  void (*play)(std::span<const std::uint8_t> input);
};

constexpr Fuzzer kFuzzers[] = {
    {"client", playClient},
    {"server", playServer},
    {"tools", playTools},
    {"recording", playRecording},
    {"frames", playFrames},
    {"startup", playStartup},
    {"server_router", playServerRouter},
    {"client_router", playClientRouter},
};

// A variable, because libFuzzer checks the arguments itself and gives them to its child processes.
const Fuzzer& chosenFuzzer() {
  const char* const name = std::getenv("MPF_FUZZER");
  for (const auto& fuzzer : kFuzzers) {
    if (name != nullptr && fuzzer.name == name) return fuzzer;
  }
  std::cerr << "MPF_FUZZER must name a fuzzer:";
  for (const auto& fuzzer : kFuzzers) std::cerr << ' ' << fuzzer.name;
  std::cerr << '\n';
  std::exit(2);
}

}  // namespace
}  // namespace mpf::test

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto& fuzzer = mpf::test::chosenFuzzer();
  fuzzer.play({data, size});
  return 0;
}
