// SPDX-License-Identifier: MIT
// Kills and restarts routers, servers and clients under load at random times: each request has one
// end, which is true. MPF_TEST_KILLS sets the number of kills in each test; the seed is printed.
#include <cstdlib>
#include <map>
#include <ranges>

#include "tests/support/random.h"
#include "tests/support/request_log.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterKillTest : public RouterTest {
 protected:
  static constexpr int kCrowd = 10;

  RouterKillTest() { ::setenv("MPF_LOCATION", std::to_string(RouterPair::kLocation).c_str(), 1); }
  void startServer() {
    counting_ = {};
    counting_ = Victim("count", routers_.far().name(), {logFile_});
    EXPECT_EQ(counting_.line(), "open");
  }
  void startFlood() { flood_ = Victim("flood", routers_.near().name()); }

  // Sends a random request: small, large, or with a deadline that may pass.
  void sendOne() {
    if (!caller_->isConnected() || caller_->open.size() >= 150) return;
    const auto number = ++lastNumber_;
    const auto deadline = random_.oneIn(8)
                              ? Deadline::after(std::chrono::microseconds(random_.below(2000)))
                              : Deadline::never();
    if (random_.oneIn(4)) {
      auto request = caller_->client.alloc<Int32Array>(1 + random_.below(2000));
      request->cmd = RequestLog::kCounted;
      request.value()[0] = number;
      send(std::move(request), number, deadline);
    } else {
      send(Int32Message({.cmd = RequestLog::kCounted, .value = number}), number, deadline);
    }
  }
  void send(Message message, std::int32_t number, Deadline deadline) {
    message.setClientExtra(number);
    std::uint32_t id = 0;
    const auto result = caller_->client.send(std::move(message), deadline, &id);
    EXPECT_THAT(result, testing::AnyOf(SendResult::sent, SendResult::queueFull,
                                       SendResult::tooManyOutstanding, SendResult::notConnected));
    if (result == SendResult::sent) caller_->open.insert(id);
  }
  // Handles all received messages: a reply or a fate for the request whose number it carries.
  void takeAll() {
    for (auto message = caller_->take(); message; message = caller_->take()) {
      const auto number = message.getClientExtra();
      EXPECT_TRUE(ends_.emplace(number, fateOf(message)).second)
          << "request " << number << " has already ended";
      if (fateOf(message)) continue;
      ++replies_;
      const auto* int32 = message.tryAs<Int32>();
      EXPECT_EQ(int32 != nullptr ? int32->value : message.valueAs<Int32Array>()[0], number)
          << "a reply to another request";
      EXPECT_GT(number, lastReplied_) << "replies must be in the order of requests";
      lastReplied_ = number;
    }
  }
  void loadFor(std::chrono::microseconds time) {
    for (const auto until = Deadline::after(time); !until.hasPassed();) {
      sendOne();
      dispatcher_->runOnce(Deadline::after(50us));
      takeAll();
    }
  }
  void killOne() {
    switch (random_.below(5)) {
      case 0:
        return routers_.startNear();
      case 1:
        return routers_.startFar();
      case 2:
        return startFlood();
      default:
        return startServer();
    }
  }
  // The last change of the connection; a full queue does not change it.
  [[nodiscard]] ConnectStatus lastChange() const {
    for (const auto status : std::views::reverse(caller_->news)) {
      if (status != ConnectStatus::connectQueueFull) return status;
    }
    return ConnectStatus::connectNo;
  }
  void waitUntilConnected() {
    while (!caller_->isConnected() || lastChange() != ConnectStatus::connectYes) {
      dispatcher_->runOnce();
      takeAll();
    }
  }
  // Waits until all requests have ended, and one after the last kill has a reply.
  void waitUntilServed() {
    waitUntilConnected();
    for (const auto before = replies_; replies_ == before || !caller_->open.empty();) {
      if (caller_->open.empty()) sendOne();
      dispatcher_->runOnce();
      takeAll();
    }
  }
  // Compares the end of each request with the requests that the servers received.
  void expectTrueEnds() const {
    for (const auto& [number, fate] : ends_) {
      const auto seen = log_.timesSeen(number);
      const auto end = fate ? toString(*fate) : "answered";
      EXPECT_GE(seen, fate ? 0 : 1) << "request " << number << ": " << end;
      EXPECT_LE(seen, fate && *fate != Fate::outcomeUnknown ? 0 : 1)
          << "request " << number << ": " << end;
    }
  }
  void TearDown() override {
    flood_ = {};
    counting_ = {};
    RouterTest::TearDown();
  }

  TemporaryFolder folder_;
  std::string logFile_ = folder_.file("requests");
  RequestLog log_{logFile_};
  Random random_;
  Victim counting_;
  Victim flood_;
  std::int32_t lastNumber_ = 0;
  std::int32_t lastReplied_ = 0;
  std::map<std::int32_t, std::optional<Fate>> ends_;
  int replies_ = 0;
};

TEST_F(RouterKillTest, EachRequestHasOneTrueEndWhenProcessesAreKilled) {
  routers_.start();
  startServer();
  startFlood();
  Victim crowd("crowd", routers_.near().name(), {std::to_string(kCrowd)});
  caller_.emplace(*dispatcher_);

  for (int round = 0; round < killsOr(40); ++round) {
    waitUntilConnected();
    loadFor(std::chrono::microseconds(random_.below(20'000)));
    killOne();
    if (random_.oneIn(3)) {
      loadFor(std::chrono::microseconds(random_.below(1000)));
      killOne();
    }
  }
  flood_ = {};
  waitUntilServed();

  expectTrueEnds();
  waitUntilAnswered(crowd);
}

}  // namespace
}  // namespace mpf::test
