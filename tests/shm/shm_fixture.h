// SPDX-License-Identifier: MIT
// ShmTest: a backplane of its own. A test fails if it leaves segments on it.
#pragma once

#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

// The text of the exception that `act` throws; empty if it throws none.
template <class Exception, class Act>
std::string whatOf(Act act) {
  try {
    act();
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

class ShmTest : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty()) << "left behind";
  }

  [[nodiscard]] const std::string& name() const { return backplane_.name(); }
  [[nodiscard]] std::string serverName(const std::string& server = "server") const {
    return SegmentName::serverWindow(name(), 0, server);
  }
  // A segment of one page without a name.
  [[nodiscard]] Segment createPage(layout::SegmentKind kind = layout::SegmentKind::pendingBind,
                                   Rights rights = {}) const {
    return Segment::create(layout::kPageBytes, kind, name(), rights);
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  TestBackplane backplane_;
};

}  // namespace mpf::test
