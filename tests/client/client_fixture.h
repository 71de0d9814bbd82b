// SPDX-License-Identifier: MIT
// ClientTest: a server and a client that take turns in one thread.
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <vector>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "client/relay_client.h"
#include "server/relay_server.h"
#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/needs_a_child.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

// Runs in a child process, which exits without the destructors of this process, and together with
// it.
inline pid_t inAChild(const std::function<void()>& work) {
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    work();
    ::_exit(0);
  }
  return child;
}

inline constexpr std::size_t kBeyondRings = 10'000;  // elements of an array that no ring holds

inline std::ptrdiff_t countNames(const Backplane& backplane, NameKind kind) {
  return std::ranges::count_if(backplane.segmentNames(), [kind](const auto& name) {
    const auto parsed = SegmentName::tryParse(name);
    return parsed && parsed->kind == kind;
  });
}

class ClientTest : public testing::Test {
 protected:
  RelayServer& startServer(ServerOptions options = {}) {
    server_ = std::make_unique<RelayServer>(backplane_, "device[0]/a", options);
    return *server_;
  }
  void bind() {
    client_.bind("device[0]/a");
    if (server_) runUntil([&] { return client_.isConnected(); });
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) {
      if (server_ && serverRuns_) server_->handleOne();
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  // Connects both, and returns a request of the client that the server has received.
  Message heldRequest() {
    const auto held = std::make_shared<Message>();
    server_->on<Int32>([held](Int32Message&& request) { *held = std::move(request); });
    bind();
    EXPECT_EQ(client_.send(Int32Message()), SendResult::sent);
    runUntil([&] { return static_cast<bool>(*held); });
    return std::move(*held);
  }
  // The next message that is not a ConnectMessage.
  Message next() {
    runUntil([&] { return !messages_.empty(); });
    auto message = std::move(messages_.front());
    messages_.erase(messages_.begin());
    return message;
  }
  // The sum over all windows of the backplane.
  [[nodiscard]] std::uint64_t protocolErrors() const {
    return sumOf(&layout::WindowControl::protocolErrors);
  }
  // A counter of all windows.
  template <class Counter>
  [[nodiscard]] std::uint64_t sumOf(Counter layout::WindowControl::* counter) const {
    std::uint64_t sum = 0;
    for (const auto& name : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(name);
      if (!parsed ||
          (parsed->kind != NameKind::serverWindow && parsed->kind != NameKind::clientWindow))
        continue;
      const bool isServer = parsed->kind == NameKind::serverWindow;
      const auto window = PeerWindow::tryOpen(
          name, isServer ? layout::SegmentKind::serverWindow : layout::SegmentKind::clientWindow);
      sum += (window->control().*counter).load(std::memory_order_relaxed);
    }
    return sum;
  }
  void TearDown() override {
    EXPECT_THAT(messages_, testing::IsEmpty());
    server_.reset();
  }

  Watchdog watchdog_{"client test"};
  TestBackplane backplane_;
  std::unique_ptr<RelayServer> server_;
  bool serverRuns_ = true;
  std::vector<Message> messages_;
  std::vector<ConnectStatus> news_;
  Dispatcher dispatcher_{backplane_};
  RelayClient client_{dispatcher_, [this](Message message) {
                        if (const auto* connect = message.tryAs<Connect>()) {
                          news_.push_back(connect->status);
                        } else {
                          messages_.push_back(std::move(message));
                        }
                      }};
};
inline std::optional<Fate> fateOf(const Message& message) {
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr ? std::optional(fate->fate) : std::nullopt;
}
}  // namespace mpf::test
