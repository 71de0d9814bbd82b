// SPDX-License-Identifier: MIT
// An adaptive wait whose yields let other threads run.
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/replaced_yield.h"

namespace mpf::test {
namespace {

class EndpointYieldTest : public ShmTest {};

TEST_F(EndpointYieldTest, MostWaitsSleepAtOnceAfterYieldsWithoutAnEvent) {
  constexpr int kWaits = 200;
  End server(backplane_, "server", WaitMode::adaptive);
  bool yielded = false;
  const std::function<void()> yield = [&] {
    yielded = true;
    othersRun(10us);
  };
  const ReplacedYield replaced(yield);

  int yielding = 0;
  for (int i = 0; i < kWaits; ++i) {
    yielded = false;
    EXPECT_FALSE(server.endpoint.wait(Deadline::after(1ms)));
    yielding += yielded ? 1 : 0;
  }

  EXPECT_GT(yielding, 0);
  EXPECT_LT(yielding, kWaits / 2) << "about 7, unless others use the processor";
}

}  // namespace
}  // namespace mpf::test
