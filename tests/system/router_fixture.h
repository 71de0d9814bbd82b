// SPDX-License-Identifier: MIT
// RouterTest: two routers, a client on the local side and a server on the remote side. Client and
// server take turns in the test's own thread; only the routers are processes.
#pragma once

#include <chrono>
#include <fmt/format.h>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <utility>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/caller.h"
#include "tests/support/router_pair.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

// Dead times that are shorter, and longer, than the pauses of the tests.
const RouterPair::Options kSoonDead{"--dead-time", "3s"};
const RouterPair::Options kPatient{"--dead-time", "60s"};

class RouterTest : public testing::Test {
 protected:
  explicit RouterTest(RouterPlace place = {}) : routers_(std::move(place)) {}

  // Opens the server. serve_ is called for each request that it receives; by default it sends the
  // request back.
  void openServer(ServerOptions options = {}) {
    options.location = RouterPair::kLocation;
    server_ = std::make_unique<MessageServer>(routers_.far(), "echo", options);
  }
  // Starts both routers, the server and a client, and waits until the client is connected.
  void startAll(const RouterPair::Options& more = {}) {
    routers_.start(more);
    openServer();
    caller_.emplace(*dispatcher_);
    runUntil([&] { return caller_->isConnected(); });
  }
  // Restarts the server, waits until the client is connected to it, and clears the notifications.
  void restartServer(const ServerOptions& options = {}) {
    server_.reset();
    runUntil([&] { return caller_->news.back() == ConnectStatus::connectNo; });
    openServer(options);
    runUntil([&] { return caller_->isConnected(); });
    caller_->news.clear();
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) {
      runServer();
      dispatcher_->runOnce(Deadline::after(200us));
    }
  }
  // Makes one round trip.
  void expectAnswer() {
    runUntil([&] { return caller_->isConnected(); });
    caller_->send(Int32Message({.value = ++value_}));
    const auto answer = next();
    ASSERT_EQ(answer.getType(), MessageType::int32) << "the end of the request is a fate";
    EXPECT_EQ(answer.tryAs<Int32>()->value, value_);
  }
  // The server sends each request back and records its number (numberOf), so that nothing is
  // delivered twice.
  void serveOnceEach() {
    serve_ = [this](Message&& request) {
      EXPECT_TRUE(delivered_.insert(numberOf(request)).second)
          << numberOf(request) << " was delivered twice";
      static_cast<void>(server_->reply(std::move(request)));
    };
  }
  // The value of an Int32, or the first value of an Int32Array.
  static std::int32_t numberOf(const Message& message) {
    const auto* int32 = message.tryAs<Int32>();
    return int32 != nullptr ? int32->value : message.valueAs<Int32Array>()[0];
  }
  void waitForNews(ConnectStatus status) {
    runUntil([&] { return !caller_->news.empty() && caller_->news.back() == status; });
  }
  void runFor(Nanoseconds time) {
    runUntil([until = Deadline::after(time)] { return until.hasPassed(); });
  }
  // The next reply or fate that the client receives.
  Message next() {
    runUntil([&] { return !caller_->messages.empty(); });
    return caller_->take();
  }
  // The next request that the server receives.
  Message nextRequest() {
    for (;;) {
      if (auto request = server_->receive()) return request;
      dispatcher_->runOnce(Deadline::after(200us));
    }
  }
  // Waits until the local router has received this number of requests for the current server, so
  // that none waits for the router.
  void waitUntilTaken(const std::string& server, std::uint64_t requests) {
    const auto window =
        SegmentName::serverWindow(routers_.near().name(), RouterPair::kLocation, server);
    const auto proxy = PeerWindow::tryOpen(window, layout::SegmentKind::serverWindow);
    runUntil([&] { return proxy->control().received.load(std::memory_order_relaxed) >= requests; });
  }
  // Waits until the current server has answered all requests of each client of a crowd
  // (victim.cpp), each with its own replies.
  void waitUntilAnswered(Victim& crowd) const {
    const auto window =
        SegmentName::serverWindow(routers_.near().name(), RouterPair::kLocation, "echo");
    for (auto line = crowd.line();; line = crowd.line()) {
      ASSERT_THAT(
          line, testing::AnyOf(testing::StartsWith("answered "), testing::StartsWith("waiting: ")));
      const auto proxy = PeerWindow::tryOpen(window, layout::SegmentKind::serverWindow);
      if (proxy && line == fmt::format("answered {:x}", proxy->header().incarnation)) return;
    }
  }
  void runServer() {
    if (!server_ || !serverRuns_) return;
    // At most 100 requests, so that the client has its turn.
    for (int left = 100; left > 0; --left) {
      auto request = server_->receive();
      if (!request) return;
      if (serve_) {
        serve_(std::move(request));
      } else {
        static_cast<void>(server_->reply(std::move(request)));
      }
      if (!serverRuns_) return;
    }
  }
  void TearDown() override {
    caller_.reset();
    dispatcher_.reset();
    server_.reset();
    routers_.expectGoodEnd();
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  RouterPair routers_;
  std::unique_ptr<MessageServer> server_;
  bool serverRuns_ = true;
  std::function<void(Message&&)> serve_;
  std::optional<Dispatcher> dispatcher_{routers_.near()};
  std::optional<Caller> caller_;
  std::int32_t value_ = 0;  // the last one of expectAnswer()
  std::set<std::int32_t> delivered_;  // numbers, by serveOnceEach()
};

}  // namespace mpf::test
