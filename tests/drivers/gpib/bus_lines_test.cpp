// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_lines.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

TEST(GpibLines, AreActiveWhenOneDeviceDrivesThem) {
  GpibLines lines{gpib_line::kAtn, 0x0f};

  lines |= {gpib_line::kDav, 0x81};

  EXPECT_TRUE(lines.has(gpib_line::kAtn));
  EXPECT_TRUE(lines.has(gpib_line::kDav));
  EXPECT_FALSE(lines.has(gpib_line::kEoi));
  EXPECT_EQ(lines.data, 0x8f);
}

TEST(GpibLines, NamesTheActiveLines) {
  EXPECT_EQ(namesOfLines(0), "none");
  EXPECT_EQ(namesOfLines(gpib_line::kRen), "REN");
  EXPECT_EQ(namesOfLines(0xff), "ATN DAV NRFD NDAC EOI SRQ IFC REN");
}

}  // namespace
}  // namespace mpf::test
