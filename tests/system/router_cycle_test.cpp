// SPDX-License-Identifier: MIT
// Two routers on each of two hosts, whose locations form a cycle: each host offers the servers of
// the location that it reaches through the other one.
//
//   near: ─► mpf-router ══ TCP ══ mpf-router ─► server :far
//         ◄─ mpf-router ══ TCP ══ mpf-router ◄─
#include <fstream>
#include <gtest/gtest.h>
#include <optional>
#include <string>

#include "router/server_name.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

std::uint32_t count(const std::string& text, const std::string& part) {
  std::uint32_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

class RouterCycleTest : public RouterTest {
 protected:
  void startCycle() {
    routers_.start();
    const auto location = std::to_string(RouterPair::kLocation);
    backTo_.emplace(RouterPair::Options{"--backplane", routers_.near().name(), "--serve", location,
                                        "--listen", back_.address(), "--plain"});
    backFrom_.emplace(RouterPair::Options{"--backplane", routers_.far().name(), "--remote",
                                          location + "=" + back_.address(), "--plain"});
  }
  // Of all lines of the routers of a backplane.
  static std::uint64_t bindingsOn(const Backplane& backplane) {
    std::uint64_t bindings = 0;
    for (const auto& name : segments::list(SegmentName::prefix(backplane.name()) +
                                           static_cast<char>(NameKind::router))) {
      std::ifstream file(segments::path(name), std::ios::binary);
      file.seekg(layout::kRouterLinesOffset);
      layout::RouterLine line{};
      while (file.read(reinterpret_cast<char*>(&line), sizeof line))
        bindings += line.bindings.load(std::memory_order_relaxed);
    }
    return bindings;
  }
  static std::shared_ptr<PeerWindow> windowOn(const Backplane& backplane) {
    return PeerWindow::tryOpen(
        SegmentName::serverWindow(backplane.name(), RouterPair::kLocation, "echo"),
        layout::SegmentKind::serverWindow);
  }
  void tryOpenServer() try { openServer(); } catch (const NameInUse&) {
    runFor(1ms);
  }
  // Whether the server of the far backplane answers a request of the near client.
  bool isAnswered() {
    runUntil([&] { return caller_->isConnected(); });
    caller_->send(Int32Message({.value = 1}));
    return next().getType() == MessageType::int32;
  }
  [[nodiscard]] bool isLimitReached() {
    const std::string limit = "the locations of routers form a cycle";
    return count(routers_.farRouter().said(), limit) + count(backTo_->said(), limit) != 0;
  }
  void TearDown() override {
    for (auto* router : {&backFrom_, &backTo_}) {
      EXPECT_EQ((*router)->end(SIGTERM), 0) << (*router)->said();
      router->reset();
    }
    RouterTest::TearDown();
  }

  FreePort back_;
  std::optional<RouterProcess> backTo_;  // listens at back_
  std::optional<RouterProcess> backFrom_;  // connects to it
};

TEST_F(RouterCycleTest, ForgetsAServerThatHasEnded) {
  startCycle();
  // A client on each host waits, so that both routers that connect have bound to the server.
  caller_.emplace(*dispatcher_);
  Dispatcher farDispatcher(routers_.far());
  Caller farCaller(farDispatcher);
  for (const auto* const backplane : {&routers_.near(), &routers_.far()})
    runUntil([&] { return bindingsOn(*backplane) == 2; });
  openServer();
  runUntil([&] {
    farDispatcher.runPending();
    return caller_->isConnected() && farCaller.isConnected();
  });
  EXPECT_EQ(windowOn(routers_.far())->header().hops, 0u);
  EXPECT_EQ(windowOn(routers_.near())->header().hops, 1u);
  backFrom_->waitUntilSaid("cannot be offered here: server \"echo\" at location 1 is already");

  // As long as this router stands, the other host believes that the server is on this one.
  backTo_->stop();
  server_.reset();
  runUntil([&] {
    farDispatcher.runPending();
    return count(backFrom_->said(), "is available") != 0;
  });
  backTo_->resume();
  runUntil([&] {
    farDispatcher.runPending();
    return isLimitReached() || (!windowOn(routers_.near()) && !windowOn(routers_.far()));
  });

  // Proxies may follow each other for a moment, up to the limit.
  while (!server_ || !isAnswered()) {
    farDispatcher.runPending();
    if (!server_) tryOpenServer();
  }
  constexpr auto kOfTheNextServer = 1u;
  EXPECT_LE(count(routers_.nearRouter().said() + backFrom_->said(), "is available"),
            router::kMaxHops + kOfTheNextServer);
}

}  // namespace
}  // namespace mpf::test
