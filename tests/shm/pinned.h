// SPDX-License-Identifier: MIT
// Pinned: keeps this thread on its processor while it exists.
#pragma once

#include <sched.h>

#include <gtest/gtest.h>

namespace mpf::test {

class Pinned {
 public:
  Pinned() {
    EXPECT_EQ(sched_getaffinity(0, sizeof before_, &before_), 0);
    cpu_set_t here;
    CPU_ZERO(&here);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &here);
    EXPECT_EQ(sched_setaffinity(0, sizeof here, &here), 0);
  }
  ~Pinned() { EXPECT_EQ(sched_setaffinity(0, sizeof before_, &before_), 0); }
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;

 private:
  cpu_set_t before_{};
};

}  // namespace mpf::test
