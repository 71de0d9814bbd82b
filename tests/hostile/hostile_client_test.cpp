// SPDX-License-Identifier: MIT
// A hostile client writes invalid data. Its server loses only that link: an honest client gets
// right answers at the same time.
#include <algorithm>
#include <array>

#include <mpf/sync_client.h>

#include "tests/hostile/hostile_peer.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class HostileClient : public HostileTest {
 protected:
  // Sends requests whose answers can be checked.
  static void ask(SyncClient& client, int number) {
    auto answer = client.call(Float64Message({.value = number + 0.5}), 60s);
    ASSERT_TRUE(answer) << answer.why();
    ASSERT_EQ(answer.message().tryAs<Float64>()->value, number + 1.5);
    if (number % 4 != 0) return;
    auto array = client.client().alloc<Float64Array>(500);
    std::ranges::fill(array.value(), number);
    answer = client.call(std::move(array), 60s);
    ASSERT_TRUE(answer) << answer.why();
    const auto values = answer.message().valueAs<Float64Array>();
    if (values.size() == 3000) return;  // a new one
    ASSERT_EQ(values.size(), 500u);
    ASSERT_TRUE(std::ranges::all_of(values, [number](double value) { return value == number; }));
  }
};

TEST_P(HostileClient, CostsItsServerOnlyThatLink) {
  Victim server("serve", backplane_.name());
  SyncClient honest(backplane_, "echo");
  int asked = 0;
  while (asked < 16) ASSERT_NO_FATAL_FAILURE(ask(honest, ++asked));
  const auto before = Usage::of(server.pid());

  for (int seed = 0; seed < seeds(); ++seed) {
    {
      const HostilePeer mad("client", backplane_.name(), GetParam());
      while (!mad.hasActed()) {
        ASSERT_NO_FATAL_FAILURE(ask(honest, ++asked));
        ASSERT_FALSE(mad.hasFailed());
      }
    }
    static_cast<void>(backplane_.removeDead());
    while (!Usage::of(server.pid()).isWithin(before, kSlackKb))
      ASSERT_NO_FATAL_FAILURE(ask(honest, ++asked));
  }

  EXPECT_TRUE(honest.client().isConnected());
  std::cout << asked << " right answers; " << before << " before, " << Usage::of(server.pid())
            << " after\n";
  const auto status = server.end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}
INSTANTIATE_TEST_SUITE_P(OfEachKind, HostileClient, testing::ValuesIn(kAttacks),
                         [](const auto& parameter) { return std::string(parameter.param); });

}  // namespace
}  // namespace mpf::test
