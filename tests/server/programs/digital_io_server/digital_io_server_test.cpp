// SPDX-License-Identifier: MIT
// What both servers of a module have in common: reads, refusals, faults of the module.
#include "tests/server/programs/digital_io_server/digital_io_fixture.h"

namespace mpf::test {
namespace {

using namespace digital;

TEST_F(DigitalIoServerTest, ReadsBitsThroughAMask) {
  start();
  model_->setInputs(kAll, 0xabcdef);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits, .address = 0xff00ff}).value, 0xab00ef);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits, .address = -1}).value, 0xabcdef);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits16, .address = 0xff}).value, 0xef);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits16, .address = -1, .extra = 4}).value, 0xbcde);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits16, .address = 0xff, .extra = 16}).value, 0xab);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits16, .address = 0xff, .extra = 17}).status, -1);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits16, .address = 0xff, .extra = -1}).status, -1);
  EXPECT_EQ(out_.ask({.cmd = cmdClearBits, .address = 0xf0}).status, 0);
  EXPECT_EQ(out_.ask({.cmd = cmdReadBits, .address = 0xff}).value, 0x0f);
  EXPECT_EQ(out_.ask({.cmd = cmdReadBits16, .address = 0xff, .extra = 4}).value, 0xf0);
}

TEST_F(DigitalIoServerTest, RefusesInvalidRequests) {
  start();
  EXPECT_EQ(out_.ask({.cmd = cmdSetBits, .address = 0x1000000}).status, -1);
  EXPECT_EQ(out_.ask({.cmd = cmdSetDAC, .value = 1}).status, -1);
  for (const auto cmd : {0, -1, 3, 4, 9, 77})
    EXPECT_EQ(out_.ask({.cmd = cmd, .address = 1}).status, -1) << cmd;
  for (const auto cmd : {0, -1, 1, 2, 5, 6, 77})
    EXPECT_EQ(in_.ask({.cmd = cmd, .address = 1}).status, -1) << cmd;
  EXPECT_EQ(model_->outputs(), 0xffffffu);
  EXPECT_EQ(alarms("dioOut"), 0u);
  EXPECT_EQ(alarms("dioIn"), 0u);
}

TEST_F(DigitalIoServerTest, RepliesToRequestsOfEveryType) {
  start();
  in_.expectRefusalOfOtherTypes();
  out_.expectRefusalOfOtherTypes();
}

TEST_F(DigitalIoServerTest, ReportsThatItsModuleFailsAndWorksAgain) {
  start({.pollEvery = 1ms, .vector = 116, .rising = kAll, .falling = kAll});
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor, .address = 1}).status, 0);

  carrier_.unplug("IP_a");
  const auto gone = in_.next();
  EXPECT_EQ(gone.status, -1);
  EXPECT_EQ(gone.value, kAll);
  EXPECT_EQ(alarms("dioIn"), 1u);
  EXPECT_EQ(out_.ask({.cmd = cmdSetBits, .address = 1}).status, -1);
  EXPECT_EQ(out_.ask({.cmd = cmdReadBits, .address = 1}).status, -1);
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits, .address = 1}).status, -1);
  EXPECT_EQ(in_.ask({.cmd = cmdSetEdges, .address = 1, .value = 1}).status, -1);
  EXPECT_EQ(alarms("dioOut"), 2u);
  HardwareAsker late(backplane_, "dioIn");
  EXPECT_EQ(late.ask({.cmd = cmdStartMonitor}).status, -1);

  const auto alarmsOfInputs = alarms("dioIn");
  plug();
  EXPECT_EQ(in_.next().status, 0);
  EXPECT_EQ(late.next().status, 0);
  EXPECT_EQ(out_.ask({.cmd = cmdSetBits, .address = 1}).status, 0);
  EXPECT_EQ(alarms("dioIn"), alarmsOfInputs + 1);
}

}  // namespace
}  // namespace mpf::test
