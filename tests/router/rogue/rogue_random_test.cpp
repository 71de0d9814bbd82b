// SPDX-License-Identifier: MIT
// Rogues that send random items until the router closes their connection. MPF_TEST_SEEDS multiplies
// the number of rogues (default 1).
#include <cstdlib>

#include "tests/router/rogue/random_items.h"
#include "tests/router/rogue/rogue_fixture.h"
#include "tests/support/caller.h"

namespace mpf::test {
namespace {

constexpr std::size_t kRandomSlackKb = 32 << 10;

class RandomRogueTest : public RogueTest {
 protected:
  static int seeds() {
    const char* set = std::getenv("MPF_TEST_SEEDS");
    return set != nullptr ? std::atoi(set) : 1;
  }
  // Sends frames until the router closes the connection, at most kFrames.
  void play(RoguePeer peer, Side side) {
    constexpr int kFrames = 200;
    RandomItems items(random_, side);
    if (!random_.oneIn(16)) peer.sendItems({greeting()});
    for (int frame = 0; frame < kFrames && peer.send(items.frame()); ++frame) {
      while (peer.hasData()) {
        const auto item = peer.next();
        if (!item) return;
        items.learn(*item);
      }
    }
  }
  Random random_;
};

TEST_F(RandomRogueTest, ConnectsToAServerRouter) {
  constexpr int kRogues = 200;
  startAll({}, {});
  const auto pid = routers_.farRouter().pid();
  const auto before = Usage::of(pid);

  for (int rogue = 0; rogue < kRogues * seeds(); ++rogue) {
    play(RoguePeer(routers_.address()), Side::client);
    if (rogue % 10 == 0) expectHonestWork();
    ASSERT_FALSE(HasFailure());
  }

  expectUsageOf(pid, before, kRandomSlackKb);
}

TEST_F(RandomRogueTest, AcceptsAClientRouter) {
  constexpr int kRogues = 100;
  constexpr std::int32_t kLocation = 2;
  constexpr std::size_t kOutstanding = 10;
  RogueHost host;
  startAll({}, {"--remote", std::to_string(kLocation) + "=" + host.address(), "--first-retry",
                "1ms", "--last-retry", "1ms"});
  const auto pid = routers_.nearRouter().pid();
  const auto before = Usage::of(pid);
  std::atomic<bool> ends{false};
  // Clients of the rogue's server: each of their requests ends once, whatever the rogue sends.
  std::thread local([&] {
    Dispatcher dispatcher(routers_.near());
    Caller first(dispatcher, "echo", kLocation);
    Caller second(dispatcher, "echo", kLocation);
    for (std::int32_t value = 0; !ends; ++value) {
      for (auto* caller : {&first, &second}) {
        std::uint32_t id = 0;
        // The queue may be shorter than this, because the rogue sets its size.
        const bool isMany = caller->open.size() >= kOutstanding;
        if (!isMany && caller->client.send(Int32Message({.value = value}), Deadline::never(),
                                           &id) == SendResult::sent)
          caller->open.insert(id);
        caller->messages.clear();
      }
      dispatcher.runOnce(Deadline::after(std::chrono::microseconds(200)));
    }
  });

  for (int rogue = 0; rogue < kRogues * seeds(); ++rogue) {
    play(host.accept(), Side::server);
    if (rogue % 10 == 0) expectHonestWork();
    if (HasFailure()) break;
  }
  ends = true;
  local.join();

  EXPECT_LE(Usage::of(pid).residentKb,
            before.residentKb + (kIsSanitized ? std::size_t{1} << 20 : kRandomSlackKb))
      << before << " before";
}

}  // namespace
}  // namespace mpf::test
