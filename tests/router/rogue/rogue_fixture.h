// SPDX-License-Identifier: MIT
// RogueTest: two routers with an honest client and server that work throughout the test, and a
// rogue peer of one of the routers.
//
//   near: honest client ─► mpf-router ══════ mpf-router ─► server :far
//                              ║                 ║
//                         RogueHost           RoguePeer
#pragma once

#include <atomic>
#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/router/rogue/rogue_peer.h"
#include "tests/support/router_pair.h"
#include "tests/support/usage.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

// A server that returns each request as its reply, on a thread of its own.
class EchoServer {
 public:
  explicit EchoServer(const Backplane& backplane)
      : server_(backplane, "echo", {.location = RouterPair::kLocation}),
        thread_([this] { run(); }) {}
  ~EchoServer() {
    ends_ = true;
    server_.interrupt();
    thread_.join();
  }
  EchoServer(const EchoServer&) = delete;
  EchoServer& operator=(const EchoServer&) = delete;

 private:
  void run() {
    while (!ends_) {
      static_cast<void>(server_.waitForMessage());
      while (auto request = server_.receive()) static_cast<void>(server_.reply(std::move(request)));
    }
  }
  MessageServer server_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

// A client that sends requests on a thread of its own, with short pauses, until the first wrong
// answer.
class HonestClient {
 public:
  explicit HonestClient(const Backplane& backplane)
      : client_(backplane, "echo", RouterPair::kLocation), thread_([this] { run(); }) {}
  ~HonestClient() {
    ends_ = true;
    thread_.join();
  }
  HonestClient(const HonestClient&) = delete;
  HonestClient& operator=(const HonestClient&) = delete;

  // Waits for some more answers. Returns false after a wrong answer.
  [[nodiscard]] bool tryWork() const noexcept {
    constexpr int kMore = 5;
    auto answers = answers_.load();
    for (const auto enough = answers + kMore; answers < enough && !hasFailed_; answers = answers_)
      answers_.wait(answers);
    return !hasFailed_;
  }

 private:
  void run() {
    for (std::int32_t number = 0; !ends_ && !hasFailed_; ++number) {
      auto answer = client_.call(Int32Message({.value = number}), std::chrono::seconds(60));
      const auto* value = answer.message().tryAs<Int32>();
      if (value == nullptr || value->value != number) {
        std::cerr << "honest client: answer " << number << ": " << answer.why() << '\n';
        hasFailed_ = true;
      }
      ++answers_;
      answers_.notify_all();
      // The rogue needs processor time, too.
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }
  SyncClient client_;
  std::atomic<bool> ends_{false};
  std::atomic<int> answers_{0};
  std::atomic<bool> hasFailed_{false};
  std::thread thread_;
};

class RogueTest : public testing::Test {
 protected:
  void startAll(const RouterPair::Options& far, const RouterPair::Options& near) {
    routers_.startFar(far);
    routers_.startNear(near);
    server_ = std::make_unique<EchoServer>(routers_.far());
    honest_ = std::make_unique<HonestClient>(routers_.near());
    expectHonestWork();
  }
  // Expects that the honest client receives some more correct answers.
  void expectHonestWork() { ASSERT_TRUE(honest_->tryWork()); }
  // Waits until the router uses no more resources than before; it may still be closing a connection
  // or reconnecting.
  void expectUsageOf(pid_t router, const Usage& before, std::size_t slackKb) {
    for (auto now = Usage::of(router); !now.isWithin(before, slackKb); now = Usage::of(router)) {
      std::cout << before << " before, " << now << '\n';
      ASSERT_NO_FATAL_FAILURE(expectHonestWork());
    }
  }
  void TearDown() override {
    if (honest_) expectHonestWork();
    honest_.reset();
    server_.reset();
    routers_.expectGoodEnd();
  }

  const Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  RouterPair routers_;
  std::unique_ptr<EchoServer> server_;
  std::unique_ptr<HonestClient> honest_;
};

}  // namespace mpf::test
