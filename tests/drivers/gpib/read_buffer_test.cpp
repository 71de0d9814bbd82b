// SPDX-License-Identifier: MIT
#include "drivers/gpib/read_buffer.h"

#include <gtest/gtest.h>

#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

TEST(ReadBuffer, IsIncompleteWithoutLimitOrEnd) {
  ReadBuffer buffer;

  buffer.append(raw("1.5"), false);

  EXPECT_FALSE(buffer.take({.maxBytes = 4}));
  EXPECT_EQ(textOf(buffer.takeAll()), "1.5");
  EXPECT_TRUE(buffer.takeAll().empty());
}

TEST(ReadBuffer, EndCompletesARead) {
  ReadBuffer buffer;

  buffer.append(raw("1."), false);
  buffer.append(raw("5"), true);

  const auto result = buffer.take({.maxBytes = 100});
  ASSERT_TRUE(result);
  EXPECT_EQ(textOf(result->data), "1.5");
  EXPECT_TRUE(result->sawEnd);
  EXPECT_FALSE(buffer.take({.maxBytes = 100}));
}

TEST(ReadBuffer, TheEndBelongsToTheLastByteOnly) {
  ReadBuffer buffer;
  buffer.append(raw("abc"), true);

  const auto first = buffer.take({.maxBytes = 2});
  const auto second = buffer.take({.maxBytes = 2});

  EXPECT_EQ(textOf(first->data), "ab");
  EXPECT_FALSE(first->sawEnd);
  EXPECT_EQ(textOf(second->data), "c");
  EXPECT_TRUE(second->sawEnd);
}

TEST(ReadBuffer, StopsAtTheEndOfStringWithinTheCount) {
  ReadBuffer buffer;
  buffer.append(raw("1;2;3"), false);

  EXPECT_EQ(textOf(buffer.take({.maxBytes = 100, .endOfString = ';'})->data), "1;");
  EXPECT_EQ(textOf(buffer.take({.maxBytes = 1, .endOfString = ';'})->data), "2");
  EXPECT_EQ(textOf(buffer.take({.maxBytes = 100, .endOfString = ';'})->data), ";");
  EXPECT_FALSE(buffer.take({.maxBytes = 100, .endOfString = ';'}));
}

TEST(ReadBuffer, EndWithoutBytesIsNoEnd) {
  ReadBuffer buffer;

  buffer.append({}, true);

  EXPECT_FALSE(buffer.take({.maxBytes = 1}));
}

}  // namespace
}  // namespace mpf::test
