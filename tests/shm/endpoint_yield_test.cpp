// SPDX-License-Identifier: MIT
// An adaptive wait whose yields let other threads run. This file replaces sched_yield().
#include <sys/syscall.h>
#include <unistd.h>

#include <functional>

#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace {

thread_local const std::function<void()>* duringYield = nullptr;

}  // namespace

extern "C" int sched_yield() noexcept {
  if (duringYield == nullptr) return static_cast<int>(::syscall(SYS_sched_yield));
  (*duringYield)();
  return 0;
}

namespace mpf::test {
namespace {

// Waits for a millisecond; each yield takes 10 us, as if others ran. Returns whether there was one.
bool yieldsInAWait(End& end) {
  bool yields = false;
  const std::function<void()> othersRun = [&] {
    yields = true;
    const auto until = Deadline::after(10us);
    while (!until.hasPassed()) {
    }
  };
  duringYield = &othersRun;
  static_cast<void>(end.endpoint.wait(Deadline::after(1ms)));
  duringYield = nullptr;
  return yields;
}

class EndpointYieldTest : public ShmTest {};

TEST_F(EndpointYieldTest, MostWaitsSleepAtOnceAfterYieldsWithoutAnEvent) {
  constexpr int kWaits = 200;
  End server(backplane_, "server", WaitMode::adaptive);

  int yielding = 0;
  for (int i = 0; i < kWaits; ++i) yielding += yieldsInAWait(server) ? 1 : 0;

  EXPECT_GT(yielding, 0);
  EXPECT_LT(yielding, kWaits / 2) << "about 7, unless others use the processor";
}

}  // namespace
}  // namespace mpf::test
