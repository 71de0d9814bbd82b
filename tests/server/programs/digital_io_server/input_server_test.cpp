// SPDX-License-Identifier: MIT
// Monitors of the inputs, and faults of interrupts.
#include "server/programs/digital_io_server/input_server.h"

#include <atomic>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>

#include "tests/server/programs/digital_io_server/digital_io_fixture.h"
#include "tests/support/victim.h"

namespace mpf::test {
namespace {

using namespace digital;

TEST_F(DigitalIoServerTest, SendsAMonitorTheInputsImmediatelyAndEachChange) {
  start();
  const auto first = in_.ask({.cmd = cmdStartMonitor});
  EXPECT_EQ(first.status, 0);
  EXPECT_EQ(first.value, kAll);
  for (int i = 0; i < 50; ++i) {
    model_->setInputs(0x9, i % 2 == 0 ? 0 : 9);
    const auto change = in_.next();
    EXPECT_EQ(change.status, 0);
    EXPECT_EQ(change.value, i % 2 == 0 ? 0xfffff6 : kAll);
    EXPECT_EQ(change.address, 9);
  }
}

// A client that reads without a pause, with many requests in transit, does not delay changes: the
// server replies to at most one more of its requests before it sends them. Bit 5 is low in reads
// that begin after the server has received the change, and the bus is slow, so that requests wait.
TEST_F(DigitalIoServerTest, SendsChangesWhileAnotherClientReadsWithoutAPause) {
  start({.pollEvery = kNever, .vector = 116, .falling = 1});
  std::atomic<bool> isHeard{false}, ends{false};
  // behind the server's
  const auto subscription = io_->subscribe([&](const DigitalIoChange&) { isHeard = true; });
  model_->connect(5, [&] {
    for (const auto busy = Deadline::after(20us); !busy.hasPassed();) {
    }
    return isHeard ? 0.0 : 5.0;
  });
  std::optional<MessageClient> client;
  int changes = 0, late = 0;
  std::promise<void> started;
  std::promise<int> told;
  const auto ask = [&] {
    EXPECT_EQ(client->send(Int32Message({.cmd = cmdReadBits, .address = 0x20})), SendResult::sent);
  };
  client.emplace(backplane_, [&](Message&& message) {
    const auto* const fields = message.tryAs<Int32>();
    if (fields == nullptr) return;
    if (fields->cmd == cmdStartMonitor && ++changes == 1) started.set_value();
    if (fields->cmd == cmdStartMonitor && changes == 2) told.set_value(late);
    if (fields->cmd != cmdReadBits) return;
    if (fields->value == 0) ++late;
    if (!ends) ask();
  });
  client->bind("dioIn");
  ASSERT_TRUE(client->connectWait(60s));
  ASSERT_EQ(client->send(Int32Message({.cmd = cmdStartMonitor, .address = 1})), SendResult::sent);
  for (int i = 0; i < 20; ++i) ask();
  started.get_future().wait();

  model_->setInputs(0x1, 0);

  EXPECT_LE(told.get_future().get(), 1);
  ends = true;
  client.reset();
  model_->connect(5, {});
}

// The change comes before the monitor, with it, or after it. The witness gets each change.
TEST_F(DigitalIoServerTest, LosesNoChangeWhileAMonitorStarts) {
  start();
  HardwareAsker witness(backplane_, "dioIn");
  ASSERT_EQ(witness.ask({.cmd = cmdStartMonitor}).value, kAll);
  for (std::uint32_t round = 0; round < 2000; ++round) {
    const auto level = round % 2;
    auto change = std::async(std::launch::async, [&] {
      model_->setInputs(1, level);
      io_->look();  // reports it while the server looks, too
    });
    auto inputs = in_.ask({.cmd = cmdStartMonitor}).value;
    change.get();
    static_cast<void>(witness.next());

    ASSERT_EQ(in_.ask({.cmd = cmdStopMonitor}).status, 0);
    while (const auto message = in_.client().receive(0s)) inputs = message.tryAs<Int32>()->value;
    ASSERT_EQ(static_cast<std::uint32_t>(inputs) & 1, level) << "round " << round;
  }
}

// The original MPF had one monitor: a second client replaced that of the first.
TEST_F(DigitalIoServerTest, HasAnyNumberOfMonitors) {
  start();
  std::vector<std::unique_ptr<HardwareAsker>> askers;
  for (int i = 0; i < 20; ++i) {
    askers.push_back(std::make_unique<HardwareAsker>(backplane_, "dioIn"));
    EXPECT_EQ(askers.back()->ask({.cmd = cmdStartMonitor}).value, kAll);
  }
  for (int bit = 0; bit < 10; ++bit) {
    model_->setInputs(1u << bit, 0);
    for (auto& asker : askers) EXPECT_EQ(asker->next().address, 1 << bit);
  }
}

TEST_F(DigitalIoServerTest, SendsAMonitorItsBitsOnly) {
  start();
  EXPECT_EQ(in_.ask({.cmd = cmdStartMonitor, .address = 0x2}).address, 0x2);
  model_->setInputs(0x1, 0);
  model_->setInputs(0x2, 0);
  const auto change = in_.next();
  EXPECT_EQ(change.address, 0x2);
  EXPECT_EQ(change.value, 0xfffffc);
  EXPECT_TRUE(in_.isSilent());
}

TEST_F(DigitalIoServerTest, SendsNothingAfterAStop) {
  start();
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  EXPECT_EQ(in_.ask({.cmd = cmdStopMonitor}).status, 0);
  EXPECT_EQ(in_.ask({.cmd = cmdStopMonitor}).status, -1);
  model_->setInputs(0x1, 0);
  while (io_->counters().interrupts == 0) std::this_thread::yield();
  EXPECT_EQ(in_.ask({.cmd = cmdReadBits, .address = 1}).value, 0);
  EXPECT_TRUE(in_.isSilent());
}

// The original MPF dropped the monitor at any other command.
TEST_F(DigitalIoServerTest, KeepsAMonitorDuringOtherRequestsOfItsClient) {
  start();
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  EXPECT_EQ(in_.ask({.cmd = 77}).status, -1);
  in_.expectRefusalOfOtherTypes();
  model_->setInputs(0x1, 0);
  EXPECT_EQ(in_.next().address, 1);
}

TEST_F(DigitalIoServerTest, ReplacesTheMonitorOfTheSameClient) {
  start();
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  model_->setInputs(0x1, 0);
  EXPECT_EQ(in_.next().address, 1);
  ASSERT_EQ(in_.ask({.cmd = cmdReadBits}).status, 0);
  EXPECT_TRUE(in_.isSilent());
}

TEST_F(DigitalIoServerTest, RemovesMonitorsOfClientsThatDieOrDisconnect) {
  start();
  Victim killed("listen", backplane_.name(), {"dioIn", std::to_string(cmdStartMonitor)});
  auto leaving = std::make_unique<HardwareAsker>(backplane_, "dioIn");
  ASSERT_EQ(leaving->ask({.cmd = cmdStartMonitor}).status, 0);
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  waitForMonitors(3);

  killed.end(SIGKILL);
  waitForMonitors(2);
  leaving.reset();
  waitForMonitors(1);

  model_->setInputs(0x1, 0);
  EXPECT_EQ(in_.next().address, 1);
}

// Bit 2 has a pulse while the queue of the client is full; bit 1 stays low.
TEST_F(DigitalIoServerTest, MergesTheChangesForAClientThatDoesNotReceiveForAWhile) {
  start();
  constexpr int kFlips = 1000;  // more than fit the client's queue
  HardwareAsker paused(backplane_, "dioIn");
  ASSERT_EQ(paused.ask({.cmd = cmdStartMonitor}).status, 0);
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  const auto change = [&](std::uint32_t mask, std::uint32_t bits) {
    model_->setInputs(mask, bits);
    // Other clients receive each change.
    EXPECT_EQ(static_cast<std::uint32_t>(in_.next().value) & mask, bits);
  };
  for (int i = 0; i < kFlips; ++i) change(0x1, static_cast<std::uint32_t>(i % 2));
  change(0x4, 0);
  change(0x4, 0x4);
  change(0x2, 0);

  int received = 0;
  Int32 last;
  std::int32_t changed = 0;
  do {
    last = paused.next();
    changed |= last.address;
  } while (++received <= kFlips && last.status == 0 && (last.value & 0x2) != 0);

  EXPECT_LT(received, kFlips);
  EXPECT_EQ(last.value, 0xfffffd);
  EXPECT_EQ(changed, 0x7);
  change(0x8, 0);
  EXPECT_EQ(paused.next().address, 0x8);
  EXPECT_EQ(inputs_->monitors(), 2);
}

TEST_F(DigitalIoServerTest, SetsTheEdgesThatInterrupt) {
  start({.pollEvery = kNever, .vector = 1});
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  EXPECT_EQ(in_.ask({.cmd = cmdSetEdges, .address = 0, .value = 0x4}).status, 0);
  model_->setInputs(0x4, 0);
  EXPECT_EQ(in_.next().address, 4);
}

// No client would receive changes any more: the program has to exit, and to be restarted.
TEST_F(DigitalIoServerTest, ReportsThatTheInputServerFailed) {
  start();
  std::atomic<bool> throws{false};
  model_->connect(3, [&] {
    return throws.exchange(false) ? throw std::runtime_error("a fault of a model") : 5.0;
  });
  EXPECT_FALSE(hasFailed_);
  throws = true;
  static_cast<void>(in_.client().client().connectWait(60s));
  EXPECT_EQ(in_.client().client().send(Int32Message({.cmd = cmdStartMonitor})), SendResult::sent);
  thread_.join();  // the output server was stopped
  EXPECT_TRUE(hasFailed_);
  model_->connect(3, {});
}

TEST_F(DigitalIoServerTest, FindsChangesByPollingWhenInterruptsAreLost) {
  start({.pollEvery = 1ms, .vector = 116, .rising = kAll, .falling = kAll});
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  carrier_.setFault("IP_a", ModelFault::interruptsLost);
  model_->setInputs(0x1, 0);
  EXPECT_EQ(in_.next().address, 1);
  while (alarms("dioIn") != 1) std::this_thread::yield();
  model_->setInputs(0x1, 1);
  EXPECT_EQ(in_.next().address, 1);
}

TEST_F(DigitalIoServerTest, FindsChangesDuringAnInterruptStorm) {
  start({.pollEvery = 1ms,
         .vector = 116,
         .rising = kAll,
         .falling = kAll,
         .storm = {.stormLimit = 100, .stormPause = 24h}});
  ASSERT_EQ(in_.ask({.cmd = cmdStartMonitor}).status, 0);
  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  while (alarms("dioIn") == 0) std::this_thread::yield();
  model_->setInputs(0x1, 0);
  EXPECT_EQ(in_.next().address, 1);
  EXPECT_EQ(out_.ask({.cmd = cmdClearBits, .address = 1}).status, 0);
}

}  // namespace
}  // namespace mpf::test
