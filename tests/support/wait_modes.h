// SPDX-License-Identifier: MIT
// Wait modes as parameters of a test suite: INSTANTIATE_TEST_SUITE_P(InEachWaitMode, SuiteTest, kWaitModes, nameOfWaitMode);
#pragma once

#include <gtest/gtest.h>
#include <ostream>
#include <string>

#include <mpf/shm/window.h>

namespace mpf {

// How googletest prints it, found by its name.
inline void PrintTo(WaitMode mode, std::ostream* out) {
  switch (mode) {
    case WaitMode::spin:
      *out << "Spin";
      return;
    case WaitMode::adaptive:
      *out << "Adaptive";
      return;
    case WaitMode::block:
      *out << "Block";
      return;
  }
  *out << "Unknown";
}

}  // namespace mpf

namespace mpf::test {

inline const auto kWaitModes = testing::Values(WaitMode::spin, WaitMode::adaptive, WaitMode::block);

inline std::string nameOfWaitMode(const testing::TestParamInfo<WaitMode>& info) { return testing::PrintToString(info.param); }

}  // namespace mpf::test
