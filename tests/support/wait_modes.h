// SPDX-License-Identifier: MIT
// Wait modes as parameters of a test suite: INSTANTIATE_TEST_SUITE_P(InEachWaitMode, SuiteTest,
// kWaitModes, nameOfWaitMode);
#pragma once

#include <gtest/gtest.h>
#include <ostream>
#include <string>

#include "shm/window.h"

namespace mpf {

inline std::ostream& operator<<(std::ostream& out, WaitMode mode) {
  switch (mode) {
    case WaitMode::spin:
      return out << "Spin";
    case WaitMode::adaptive:
      return out << "Adaptive";
    case WaitMode::block:
      return out << "Block";
  }
  return out << "Unknown";
}

}  // namespace mpf

namespace mpf::test {

inline const auto kWaitModes = testing::Values(WaitMode::spin, WaitMode::adaptive, WaitMode::block);

inline std::string nameOfWaitMode(const testing::TestParamInfo<WaitMode>& info) {
  return testing::PrintToString(info.param);
}

}  // namespace mpf::test
