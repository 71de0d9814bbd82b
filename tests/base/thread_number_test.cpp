// SPDX-License-Identifier: MIT
#include "base/thread_number.h"

#include <gtest/gtest.h>
#include <set>
#include <thread>

namespace mpf {
namespace {

TEST(ThreadNumberTest, EachThreadHasANumberOfItsOwnAlsoAfterOthersHaveEnded) {
  std::set<std::uint64_t> numbers{threadNumber()};
  for (int i = 0; i < 100; ++i) {
    std::thread([&] { numbers.insert(threadNumber()); }).join();
  }

  EXPECT_EQ(numbers.size(), 101u);
  EXPECT_TRUE(numbers.contains(threadNumber())) << "it stays the same";
  for (const auto number : numbers) EXPECT_TRUE(number != 0 && number % 2 == 0) << number;
}

TEST(ThreadNumberTest, IsZeroUntilTheThreadHasAskedForIt) {
  std::uint64_t before = 1;
  std::uint64_t number = 0;
  std::uint64_t after = 0;
  std::thread([&] {
    before = threadNumberOrZero();
    number = threadNumber();
    after = threadNumberOrZero();
  }).join();

  EXPECT_EQ(before, 0u);
  EXPECT_EQ(after, number);
}

}  // namespace
}  // namespace mpf
