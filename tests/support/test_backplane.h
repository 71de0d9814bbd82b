// SPDX-License-Identifier: MIT
// TestBackplane: an isolated backplane for one test. The destructor removes the segments of killed
// processes; any other segment that is left fails the test. If the test dies, its guard removes all
// segments. Declare it before the objects that use it.
#pragma once

#include <gmock/gmock.h>

#include <mpf/backplane.h>

#include "tests/support/guard.h"

namespace mpf::test {

class TestBackplane : public Backplane {
 public:
  TestBackplane() : Backplane(Backplane::isolated()) { guardBackplane(name()); }
  TestBackplane(const TestBackplane&) = delete;
  TestBackplane& operator=(const TestBackplane&) = delete;
  ~TestBackplane() {
    static_cast<void>(removeDead());
    EXPECT_THAT(segmentNames(), testing::IsEmpty()) << "left behind";
  }
};

}  // namespace mpf::test
