// SPDX-License-Identifier: MIT
// A GPIB server over a real controller class: a Prologix, which does not report service requests,
// on a model at the far end of a TCP connection.
#include <thread>

#include <mpf/drivers/gpib/prologix.h>

#include "drivers/gpib/meter_model.h"
#include "server/programs/gpib_server/gpib_server.h"
#include "tests/drivers/gpib/prologix_stand.h"
#include "tests/server/programs/gpib_server/gpib_asker.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace gpib;

class PrologixServerTest : public testing::Test {
 protected:
  PrologixServerTest() {
    stand_.model.attach({kMeter}, std::make_shared<MeterModel>());
    const std::jthread plugging([this] { stand_.plugIn(); });
    bus_ = std::make_unique<GpibBus>(openPrologix({.address = stand_.address()}));
    served_ = std::make_unique<GpibServer>(
        server_, *bus_, GpibLimits{.pollTimeout = std::chrono::minutes(10)}, log_);
    served_->start([] { FAIL() << "the server failed"; });
  }
  static Char8Array fieldsOf(std::int32_t cmd, std::int32_t address) {
    return {.timeout = 60, .cmd = cmd, .address = address};
  }
  static constexpr int kMeter = 3;

  Watchdog watchdog_{"Prologix server test"};
  ServerLog log_{"test", "off"};
  PrologixStand stand_{PrologixStand::Line::tcp};
  std::unique_ptr<GpibBus> bus_;
  TestBackplane backplane_;
  MessageServer server_{backplane_, "gpib"};
  std::unique_ptr<GpibServer> served_;
};

TEST_F(PrologixServerTest, EachOfFiveClientsReceivesItsOwnAnswers) {
  std::vector<std::thread> clients;
  for (int client = 0; client < 5; ++client) {
    clients.emplace_back([this, client] {
      GpibAsker asker(backplane_);
      for (int i = 0; i < 20; ++i) {
        const auto text = std::to_string(client) + ":" + std::to_string(i);
        const auto address = client % 2 == 0 ? 22 : 905;
        ASSERT_EQ(asker.ask(fieldsOf(cmdWriteRead, address), text),
                  (GpibAnswer{gpibStatusOK, gpibReadEndedByEnd, text}));
      }
    });
  }
  for (auto& client : clients) client.join();
}

TEST_F(PrologixServerTest, AServiceRequestIsFoundByPolling) {
  GpibAsker asker(backplane_);
  ASSERT_EQ(asker.ask(fieldsOf(cmdSubscribe, kMeter)).status, gpibStatusOK);

  ASSERT_EQ(asker.ask(fieldsOf(cmdWrite, kMeter), "RQS 4;SRQ\n").status, gpibStatusOK);

  const auto notice = asker.receive();
  EXPECT_EQ(notice.address, kMeter);
  EXPECT_EQ(notice.value & kGpibRequestsService, kGpibRequestsService);
}

TEST_F(PrologixServerTest, WhatTheControllerCannotDoIsUnsupported) {
  GpibAsker asker(backplane_);

  EXPECT_EQ(asker.ask(fieldsOf(cmdSendCommands, 0), "_?").status, gpibStatusUnsupported);
}

}  // namespace
}  // namespace mpf::test
