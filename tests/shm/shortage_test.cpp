// SPDX-License-Identifier: MIT
#include "shm/shortage.h"

#include <gtest/gtest.h>
#include <string>
#include <system_error>

namespace mpf {
namespace {

using layout::Shortage;

Shortage ofCode(int code) {
  return shortageOf(std::system_error(code, std::generic_category(), "open"));
}

TEST(Shortage, IsTheReasonOfAnError) {
  EXPECT_EQ(ofCode(EMFILE), Shortage::descriptors);
  EXPECT_EQ(ofCode(ENFILE), Shortage::openFiles);
  EXPECT_EQ(ofCode(ENOMEM), Shortage::memory);
  EXPECT_EQ(ofCode(EAGAIN), Shortage::threads);
  EXPECT_EQ(shortageOf(std::bad_alloc()), Shortage::memory);
  EXPECT_EQ(ofCode(EACCES), Shortage::none);
  EXPECT_EQ(shortageOf(std::runtime_error("")), Shortage::none);
}

// The value is read from shared memory.
TEST(Shortage, HasAText) {
  for (const auto shortage :
       {Shortage::descriptors, Shortage::openFiles, Shortage::memory, Shortage::threads}) {
    EXPECT_STRNE(textOf(shortage).lack, "");
    EXPECT_STRNE(textOf(shortage).remedy, "");
  }
  for (const auto shortage : {Shortage::none, static_cast<Shortage>(99)})
    EXPECT_STREQ(textOf(shortage).lack, "");
}

}  // namespace
}  // namespace mpf
