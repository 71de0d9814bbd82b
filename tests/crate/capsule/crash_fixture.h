// SPDX-License-Identifier: MIT
// CrashTest: a server process with a witness, and a client in this process that sends numbered
// requests to it.
#pragma once

#include <sys/wait.h>

#include <filesystem>
#include <gtest/gtest.h>
#include <optional>
#include <string>

#include <mpf/message_client.h>

#include "base/process_stat.h"
#include "crate/capsule/capsule.h"
#include "crate/capsule/segment_witness.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"
#include "tools/report/snapshot.h"

namespace mpf::crate::test {

inline std::uint64_t startTicksOfVictim(pid_t pid) {
  return ProcessStat::tryRead(pid)->number(ProcessStat::kStartTicks);
}

class CrashTest : public testing::Test {
 protected:
  // Starts the server and connects the client.
  void start() {
    server_ = mpf::test::Victim(MPF_TEST_CRASHING_SERVER, std::vector{backplane_.name()});
    ASSERT_EQ(server_.line(), "open");
    pid_ = server_.pid();
    witness_.watch(pid_, startTicksOfVictim(pid_));
    client_.emplace(dispatcher_, [this](Message&& reply) { take(reply); });
    client_->bind("victim");
    while (!client_->isConnected()) step();
    witness_.look();
  }
  void step() { dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(1))); }
  void take(const Message& reply) {
    if (reply.getType() == MessageType::int32) ++replies_;
  }
  void send(std::int32_t number, std::int32_t cmd = 0) {
    ASSERT_EQ(client_->send(Int32Message({.cmd = cmd, .address = 0x10, .value = number})),
              SendResult::sent);
  }
  // Sends requests and waits for the reply to each.
  void exchange(int count) {
    for (int i = 0; i < count; ++i) {
      const auto before = replies_;
      send(i);
      while (replies_ == before) step();
    }
  }
  bool isHandling() {
    const auto now = tools::Snapshot::take(backplane_.name());
    return now.servers.at(0).handling.has_value();
  }
  nlohmann::ordered_json capsule(int waitStatus) {
    witness_.look();
    Death death;
    death.process = "victim";
    death.pid = pid_;
    death.cause = Cause::ofWaitStatus(waitStatus);
    death.folder = std::filesystem::current_path();
    return capsuleOf(death, witness_.find(pid_));
  }

  const mpf::test::Watchdog watchdog_{"Crash"};
  mpf::test::TestBackplane backplane_;
  mpf::test::TemporaryFolder files_;
  SegmentWitness witness_{backplane_.name()};
  mpf::test::Victim server_;
  pid_t pid_ = 0;
  Dispatcher dispatcher_{backplane_};
  std::optional<MessageClient> client_;
  int replies_ = 0;
};

}  // namespace mpf::crate::test
