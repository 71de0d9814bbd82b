// SPDX-License-Identifier: MIT
#include "benchmarks/stage/timing.h"

#include <fcntl.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::bench {
namespace {

constexpr Budget kMoment{std::chrono::milliseconds(1), std::chrono::milliseconds(30)};

// A context without a stage.
struct Timed {
  Control control;
  RunContext context{control, kMoment, {}};
  Placement placement{{allowedCpus().front()}, {allowedCpus().front()}};
  Meter nobody{placement, Meter::kNobody};
};

TEST(TimeExchanges, CountsMessagesAndTimesExchanges) {
  Timed timed;

  timeExchanges(timed.context, timed.nobody, 100, [] { sleepFor(std::chrono::milliseconds(1)); });

  const auto& figures = timed.control.figures;
  EXPECT_EQ(figures.count, 100 * figures.latency.count());
  EXPECT_GE(figures.latency.percentileNs(50), 1'000'000u);
  EXPECT_GT(figures.perSecond, 0);
  EXPECT_LE(figures.perSecond, 100'000);
}

TEST(TimeWindow, TimesEachFromItsSendToItsReply) {
  Timed timed;
  int onTheirWay = 0;
  int most = 0;

  timeWindow(
      timed.context, timed.nobody, 4, [&] { most = std::max(most, ++onTheirWay); },
      [&] {
        sleepFor(std::chrono::milliseconds(1));
        --onTheirWay;
      });

  const auto& figures = timed.control.figures;
  EXPECT_EQ(most, 4);
  EXPECT_EQ(onTheirWay, 0) << "unreceived replies";
  EXPECT_GE(figures.latency.percentileNs(50), 3'900'000u)
      << "four receives lie between a send and its reply";
  EXPECT_LE(figures.perSecond, 1000);
}

TEST(Meter, CountsWritesOfAProcess) {
  Timed timed;
  Meter meter(timed.placement, Meter::kThisProcess);
  const int fd = ::open("/dev/null", O_WRONLY | O_CLOEXEC);

  // Read around the meter's own times, so that `seconds` is never shorter than what it measured.
  const auto fromNs = Clock::nowNs();
  meter.start();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(::write(fd, "x", 1), 1);
  sleepFor(std::chrono::milliseconds(10));
  meter.stop(timed.control.figures);
  const auto seconds = static_cast<double>(Clock::nowNs() - fromNs) / 1e9;
  ::close(fd);

  EXPECT_GE(timed.control.figures.writesPerSecond * seconds, 1000);
  EXPECT_GE(timed.control.figures.idleServer, 0);
  EXPECT_LE(timed.control.figures.idleServer, 1);
}

TEST(Meter, LeavesWritesUnknownWithoutAProcess) {
  Timed timed;

  timed.nobody.start();
  sleepFor(std::chrono::milliseconds(1));
  timed.nobody.stop(timed.control.figures);

  EXPECT_EQ(timed.control.figures.writesPerSecond, kNotLookedAt);
}

TEST(Meter, ReadsCpuTimeAndMemoryOfAProcess) {
  const test::Watchdog watchdog("CPU time of a process");
  const auto before = cpuNsOf(::getpid());
  auto now = before;

  while (now == before) now = cpuNsOf(::getpid());

  EXPECT_GT(now, before);
  EXPECT_GT(residentBytesOf(::getpid()), 0);
}

}  // namespace
}  // namespace mpf::bench
