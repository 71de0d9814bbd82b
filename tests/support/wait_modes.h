// SPDX-License-Identifier: MIT
// Wait modes as parameters of a test suite: INSTANTIATE_TEST_SUITE_P(InEachWaitMode, SuiteTest, kWaitModes, nameOfWaitMode);
#pragma once

#include <gtest/gtest.h>
#include <string>

#include <mpf/shm/window.h>

namespace mpf::test {

inline const auto kWaitModes = testing::Values(WaitMode::spin, WaitMode::adaptive, WaitMode::block);

inline std::string nameOfWaitMode(const testing::TestParamInfo<WaitMode>& info) {
  switch (info.param) {
    case WaitMode::spin:
      return "Spin";
    case WaitMode::adaptive:
      return "Adaptive";
    case WaitMode::block:
      return "Block";
  }
  return "Unknown";
}

}  // namespace mpf::test
