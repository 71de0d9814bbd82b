// SPDX-License-Identifier: MIT
// TestBackplane: an isolated backplane that ends with its test. What users of it that were killed
// left behind is removed; anything else that is left fails the test. When the test dies, its guard
// removes all segments. Declare it before whatever uses it.
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
