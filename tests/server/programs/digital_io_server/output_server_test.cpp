// SPDX-License-Identifier: MIT
#include "server/programs/digital_io_server/output_server.h"

#include "tests/server/programs/digital_io_server/digital_io_fixture.h"

namespace mpf::test {
namespace {

using namespace digital;

TEST_F(DigitalIoServerTest, SetsAndClearsBits) {
  start();
  EXPECT_EQ(out_.ask({.cmd = cmdClearBits, .address = 0xff}).status, 0);
  EXPECT_EQ(out_.ask({.cmd = cmdSetBits, .address = 0x11}).status, 0);
  EXPECT_EQ(model_->outputs(), 0xffff11u);
  EXPECT_EQ(out_.ask({.cmd = cmdWriteBits, .address = 0xff0000, .value = 0x5a0000}).status, 0);
  EXPECT_EQ(model_->outputs(), 0x5aff11u);
}

TEST_F(DigitalIoServerTest, SetsTheThreshold) {
  start({.pollEvery = kNever}, "IP-Unidig-HV-8I16O");
  EXPECT_EQ(out_.ask({.cmd = cmdSetDAC, .value = 4095}).status, 0);
  EXPECT_EQ(out_.ask({.cmd = cmdSetDAC, .value = 4096}).status, -1);
  EXPECT_EQ(carrier_.site(0).io().read16(0x1c) & 0xfff, 4095);
}

}  // namespace
}  // namespace mpf::test
