// SPDX-License-Identifier: MIT
#include "tests/fuzz/fuzzer.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mpf::test::play({data, size});
  return 0;
}
