// SPDX-License-Identifier: MIT
#include "server/programs/dac128v_server/dac128v_server.h"

#include <thread>

#include "drivers/dac128v/dac128v_model.h"
#include "tests/server/programs/hardware/hardware_fixture.h"

namespace mpf::test {
namespace {

class Dac128vServerTest : public HardwareTest {
 protected:
  void TearDown() override {
    server_.interrupt();
    thread_.join();
  }
  std::int32_t set(std::int32_t channel, std::int32_t code) {
    return asker_.ask({.address = channel, .value = code}).status;
  }

  Dac128vModel& model_ = carrier_.plug("IP_a", std::make_unique<Dac128vModel>());
  Dac128v dac_{modules_.create("dac", "ipac", "IP_a", Dac128v::kind())};
  MessageServer server_{backplane_, "dac"};
  Dac128vServer outputs_{server_, dac_, log_};
  std::thread thread_{[this] { server_.run(); }};
  HardwareAsker asker_{backplane_, "dac"};
};

TEST_F(Dac128vServerTest, SetsAChannelAndReplies) {
  const auto reply =
      asker_.ask({.timeout = 1, .cmd = 2, .status = 3, .address = 7, .extra = 4, .value = 4095});

  EXPECT_EQ(reply.status, 0);
  EXPECT_EQ(reply.timeout, 1);
  EXPECT_EQ(reply.cmd, 2);
  EXPECT_EQ(reply.address, 7);
  EXPECT_EQ(reply.extra, 4);
  EXPECT_EQ(reply.value, 4095);
  EXPECT_EQ(dac_.tryRead(7), 4095);
}

TEST_F(Dac128vServerTest, RefusesValuesOutOfRangeAndKeepsTheOutput) {
  EXPECT_EQ(set(0, 1234), 0);
  EXPECT_EQ(set(0, 4096), -1);
  EXPECT_EQ(set(0, -1), -1);
  EXPECT_EQ(set(8, 0), -1);
  EXPECT_EQ(set(-1, 0), -1);
  EXPECT_EQ(dac_.tryRead(0), 1234);
  EXPECT_EQ(alarms("dac"), 0u);
}

TEST_F(Dac128vServerTest, RepliesToRequestsOfEveryType) { asker_.expectRefusalOfOtherTypes(); }

TEST_F(Dac128vServerTest, CountsAnAlarmForEachFaultAndContinues) {
  model_.setStuck(1, 0x1);
  EXPECT_EQ(set(1, 3), -1);
  EXPECT_EQ(alarms("dac"), 1u);
  EXPECT_EQ(set(1, 2), 0);
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_EQ(set(2, 4095), -1);
  EXPECT_EQ(set(2, 0), -1);
  EXPECT_EQ(alarms("dac"), 3u);
  carrier_.setFault("IP_a", ModelFault::none);
  EXPECT_EQ(set(2, 0), 0);
  EXPECT_EQ(alarms("dac"), 3u);
}

TEST_F(Dac128vServerTest, CountsAnAlarmWhenTheModuleHadLostItsOutputs) {
  EXPECT_EQ(set(3, 5), 0);
  carrier_.unplug("IP_a");
  auto& another = carrier_.plug("IP_a", std::make_unique<Dac128vModel>());
  EXPECT_EQ(set(0, 0), 0);
  EXPECT_EQ(another.volts(3), model_.volts(3));
  EXPECT_EQ(alarms("dac"), 1u);
  EXPECT_EQ(set(0, 1), 0);
  EXPECT_EQ(alarms("dac"), 1u);
}

TEST_F(Dac128vServerTest, ContinuesWhenItsModuleIsRemoved) {
  carrier_.unplug("IP_a");
  EXPECT_EQ(set(0, 100), -1);
  auto& another = carrier_.plug("IP_a", std::make_unique<Dac128vModel>());
  EXPECT_EQ(set(0, 0), 0);
  EXPECT_EQ(another.volts(0), -10);
}

}  // namespace
}  // namespace mpf::test
