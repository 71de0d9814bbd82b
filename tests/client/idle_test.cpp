// SPDX-License-Identifier: MIT
// Threads without work sleep and are not woken.
#include <poll.h>
#include <sys/timerfd.h>

#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <mpf/file_descriptor.h>
#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "base/system_call.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/wait_modes.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

// A client with its own thread.
class IdleClient {
 public:
  IdleClient(const Backplane& backplane, WaitMode mode)
      : dispatcher_(backplane, {mode, {}}), client_(dispatcher_, [this](const Message& message) {
          if (message.getType() == MessageType::int32) answers_.fetch_add(1);
        }) {
    client_.bind("device", 0);
    thread_ = std::thread([this] {
      EXPECT_TRUE(client_.connectWait(60s));
      EXPECT_EQ(client_.send(Int32Message()), SendResult::sent);
      dispatcher_.run();
    });
  }
  ~IdleClient() {
    dispatcher_.interrupt();
    thread_.join();
  }
  IdleClient(const IdleClient&) = delete;
  IdleClient& operator=(const IdleClient&) = delete;
  [[nodiscard]] int answers() const { return answers_.load(); }
  MessageClient& client() { return client_; }

 private:
  std::atomic<int> answers_{0};
  Dispatcher dispatcher_;
  MessageClient client_;
  std::thread thread_;
};

class IdleTest : public testing::TestWithParam<WaitMode> {
 protected:
  // The number of wake-ups of each window; empty while a thread is awake.
  using Wakes = std::map<std::string, std::uint64_t>;

  void SetUp() override {
    server_.on<Int32>([](Int32&) {});
    serving_ = std::thread([this] { server_.run(); });
    for (int i = 0; i < 50; ++i)
      clients_.push_back(std::make_unique<IdleClient>(backplane_, GetParam()));
    for (const auto& client : clients_) {
      while (client->answers() == 0) std::this_thread::yield();
    }
    for (const auto& name : backplane_.segmentNames()) {
      const auto kind = SegmentName::tryParse(name)->kind;
      if (kind == NameKind::serverWindow)
        windows_.push_back(PeerWindow::tryOpen(name, layout::SegmentKind::serverWindow));
      if (kind == NameKind::clientWindow)
        windows_.push_back(PeerWindow::tryOpen(name, layout::SegmentKind::clientWindow));
    }
    ASSERT_EQ(windows_.size(), 51u);
  }
  void TearDown() override {
    clients_.clear();
    server_.interrupt();
    serving_.join();
  }
  Wakes wakesOfSleepers() const {
    Wakes wakes;
    for (const auto& window : windows_) {
      if (window->control().sleeping.load() != layout::SleepState::onFutex) return {};
      wakes[window->name()] = window->control().wakes.load();
    }
    return wakes;
  }
  // Waits until all threads sleep: seen twice in a row, because a sleeping thread may be woken by a
  // thread that was not checked yet.
  Wakes waitUntilAllSleep() const {
    for (;;) {
      const auto wakes = wakesOfSleepers();
      if (!wakes.empty() && wakes == wakesOfSleepers()) return wakes;
      std::this_thread::yield();
    }
  }
  // Longer than the longest time after which a client rings again for an outstanding reply.
  static void waitForTick() {
    const FileDescriptor timer(
        checkCall(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC), "timerfd_create"));
    itimerspec spec{};
    spec.it_value = {.tv_sec = 1, .tv_nsec = 200'000'000};
    checkCall(::timerfd_settime(timer.get(), 0, &spec, nullptr), "timerfd_settime");
    pollfd tick{timer.get(), POLLIN, 0};
    checkCall(retryInterrupted([&] { return ::poll(&tick, 1, -1); }), "poll");
  }

  // A client wakes once more after its last reply; after that nothing may happen.
  // A thread that polls or sends heartbeats would never stop.
  Wakes waitUntilIdle() const {
    auto before = waitUntilAllSleep();
    for (waitForTick(); wakesOfSleepers() != before; waitForTick()) before = waitUntilAllSleep();
    return before;
  }

  Watchdog watchdog_{"idle test"};
  TestBackplane backplane_;
  MessageServer server_{backplane_, "device", {.location = 0, .waitMode = GetParam()}};
  std::thread serving_;
  std::vector<std::unique_ptr<IdleClient>> clients_;
  std::vector<std::shared_ptr<PeerWindow>> windows_;
};

TEST_P(IdleTest, NoThreadIsWokenWhileNoMessageIsSent) { EXPECT_EQ(waitUntilIdle().size(), 51u); }

TEST_P(IdleTest, AClientThatSendsWakesTheServerAndNoOtherClient) {
  auto before = waitUntilIdle();

  for (int i = 0; i < 20; ++i)
    ASSERT_EQ(clients_[7]->client().send(Int32Message()), SendResult::sent);

  while (clients_[7]->answers() != 21) std::this_thread::yield();
  std::size_t woken = 0;
  for (const auto& [window, wakes] : waitUntilIdle()) woken += wakes != before[window] ? 1u : 0u;
  EXPECT_EQ(woken, 2u);
}

INSTANTIATE_TEST_SUITE_P(InModesThatSleep, IdleTest,
                         testing::Values(WaitMode::adaptive, WaitMode::block), nameOfWaitMode);

}  // namespace
}  // namespace mpf::test
