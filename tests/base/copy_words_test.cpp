// SPDX-License-Identifier: MIT
#include <mpf/detail/copy_words.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <gtest/gtest.h>

namespace mpf::detail {
namespace {

TEST(CopyWords, CopiesExactlyItsBytesFromAndToAnyAddress) {
  std::array<std::byte, 64> from{};
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<std::byte>(i + 1);
  std::array<std::byte, 64> to{};

  copyWords<24>(to.data() + 3, from.data() + 5);

  std::array<std::byte, 64> expected{};
  std::memcpy(expected.data() + 3, from.data() + 5, 24);
  EXPECT_EQ(to, expected);
}

TEST(CopyWords, JoinedNumbersLieInMemoryOneAfterTheOther) {
  const std::uint32_t halves[] = {0x01020304, 0xf5f6f7f8};
  const auto both = joined(halves[0], halves[1]);
  EXPECT_EQ(std::memcmp(&both, halves, sizeof both), 0);

  const std::uint16_t first = 0x0102;
  const std::uint8_t more[] = {0xf3, 0xf4};
  const auto three = joined(first, more[0], more[1]);
  EXPECT_EQ(std::memcmp(&three, &first, sizeof first), 0);
  EXPECT_EQ(std::memcmp(reinterpret_cast<const std::byte*>(&three) + sizeof first, more, 2), 0);
}

}  // namespace
}  // namespace mpf::detail
