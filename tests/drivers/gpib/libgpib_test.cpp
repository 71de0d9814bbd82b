// SPDX-License-Identifier: MIT
#include "drivers/gpib/libgpib.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace mpf::test {
namespace {

using testing::HasSubstr;

std::string whyNotLoaded(const std::string& path) {
  try {
    const LibGpib library(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "it was loaded";
}

TEST(LibGpib, FindsTheFunctionsOfALibrary) {
  const LibGpib library(MPF_TEST_FAKE_LIBGPIB);
  int address = 0;

  EXPECT_EQ(library.ask(0, LibGpib::kOwnPrimaryAddress, &address) & LibGpib::kError, 0);

  EXPECT_EQ(address, 3) << "of the fake board";
}

TEST(LibGpib, SaysThatALibraryIsAbsent) {
  const auto why = whyNotLoaded("libgpib-absent.so");
  EXPECT_THAT(why, HasSubstr("libgpib-absent.so"));
  EXPECT_THAT(why, HasSubstr("install the library of Linux GPIB"));
}

TEST(LibGpib, SaysWhichFunctionIsAbsent) {
  EXPECT_THAT(whyNotLoaded("libc.so.6"), HasSubstr("no function ibask"));
}

}  // namespace
}  // namespace mpf::test
