// SPDX-License-Identifier: MIT
#include "server/programs/ip440_server/ip440_server.h"

#include <thread>

#include <mpf/digital_io_commands.h>

#include "drivers/ip440/ip440_model.h"
#include "tests/server/programs/hardware/hardware_fixture.h"

namespace mpf::test {
namespace {

class Ip440ServerTest : public HardwareTest {
 protected:
  void TearDown() override {
    server_.interrupt();
    thread_.join();
  }
  Int32 read(std::uint32_t mask) {
    return asker_.ask({.cmd = digital::cmdReadBits, .address = static_cast<std::int32_t>(mask)});
  }

  Ip440Model& model_ = carrier_.plug("IP_c", std::make_unique<Ip440Model>(0xa5000001));
  Ip440 inputs_{modules_.create("door", "ipac", "IP_c", Ip440::kind())};
  MessageServer server_{backplane_, "door"};
  Ip440Server served_{server_, inputs_, log_};
  std::thread thread_{[this] { server_.run(); }};
  HardwareAsker asker_{backplane_, "door"};
};

TEST_F(Ip440ServerTest, ReadsTheBitsOfAMask) {
  const auto all = read(0xffffffff);
  EXPECT_EQ(all.status, 0);
  EXPECT_EQ(static_cast<std::uint32_t>(all.value), 0xa5000001);
  EXPECT_EQ(read(0xf).value, 1);
  EXPECT_EQ(asker_.ask({.cmd = digital::cmdReadBits16, .address = 0xffff, .extra = 16}).value,
            0xa500);
  model_.setInputs(0x6);
  EXPECT_EQ(read(0xf).value, 6);
}

TEST_F(Ip440ServerTest, RepliesToInvalidRequestsWithAStatus) {
  for (const std::int32_t cmd : {0, digital::cmdSetBits, digital::cmdStartMonitor, -1, INT32_MAX})
    EXPECT_EQ(asker_.ask({.cmd = cmd}).status, -1);
  for (const std::int32_t lowest : {-1, 17})
    EXPECT_EQ(asker_.ask({.cmd = digital::cmdReadBits16, .extra = lowest}).status, -1);
  asker_.expectRefusalOfOtherTypes();
  EXPECT_EQ(alarms("door"), 0u);
}

TEST_F(Ip440ServerTest, CountsAlarmsWhileItsModuleFailsAndContinues) {
  carrier_.setFault("IP_c", ModelFault::busError);
  EXPECT_EQ(read(0x1).status, -1);
  EXPECT_EQ(read(0x1).status, -1);
  EXPECT_EQ(alarms("door"), 2u);
  carrier_.setFault("IP_c", ModelFault::none);
  EXPECT_EQ(read(0x1).value, 1);
  EXPECT_EQ(alarms("door"), 2u);
}

}  // namespace
}  // namespace mpf::test
