// SPDX-License-Identifier: MIT
// Stage: runs one measurement in two processes, each pinned to its CPUs, and returns the figures.
//
//   runner ── fork ──► server     calls ready(), serves until it is killed or stopping() is true
//      └───── fork ──► requester  measures, fills the Figures
//
// The runner starts no thread and maps nothing of the measured system: a peer that crashes, hangs
// or leaks does so in these two processes.
//
// Threads  the runner's only thread.
// Crash    if a process dies or exceeds the time limit, the measurement ends with an error, and
//          both processes are killed.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <mpf/clock.h>

#include "base/latency_recorder.h"
#include "benchmarks/stage/processes.h"

namespace mpf::bench {

inline constexpr std::size_t kLineBytes = 64;

struct Placement {
  Cpus server{0};
  Cpus requester{1};
};

// The duration of a measurement.
struct Budget {
  Nanoseconds warmUp{};
  Nanoseconds measure{};
};

inline constexpr double kNotLookedAt = -1;

// The number of incomplete answers over serial lines, and how many of them had each fault according
// to their replies. One answer may have several faults.
struct LineFaultFigures {
  double shortAnswers = kNotLookedAt;
  double overruns = 0;
  double parity = 0;
  double framing = 0;
  double breaks = 0;
};

// The results of the requester. Plain data in shared memory.
struct Figures {
  LatencyRecorder latency;  // of single messages
  double typicalNs = 0;  // per message: median of groups timed as a whole
  std::uint64_t count = 0;  // number of messages for perSecond
  double perSecond = 0;  // 0: not a rate
  double value = 0;  // in the unit of the measurement
  double writesPerSecond = kNotLookedAt;  // write system calls; see Meter
  double idleServer = kNotLookedAt;  // idle share of the server's CPUs, 0 to 1
  double idleRequester = kNotLookedAt;  // idle share of the requester's CPUs, 0 to 1
  LineFaultFigures lineFaults{};  // of serial lines
  // Further values of one measurement that several rows show; from the last round.
  std::array<double, 4> more{};
};

// Shared by the processes of one measurement.
// NOLINTNEXTLINE(clang-analyzer-optin.performance.Padding): each word is on a line of its own
struct Control {
  alignas(kLineBytes) std::atomic<std::uint32_t> ready{0};  // written by the server
  std::atomic<std::uint32_t> port{0};  // written by the server, before `ready`
  alignas(kLineBytes) std::atomic<std::uint32_t> stopping{0};  // written by the requester
  // Written by the server: number of one-way messages received.
  alignas(kLineBytes) std::atomic<std::uint64_t> consumed{0};
  alignas(kLineBytes) Figures figures;  // written by the requester
  std::array<std::array<char, 240>, 2> errors{};  // each process writes its own
  // Written by the requester: what it waits for, and how many of them it has got.
  std::array<char, 120> waitsFor{};
  std::atomic<std::uint64_t> got{0};
};

// The interface between a process of a measurement and the Stage.
class RunContext {
 public:
  RunContext(Control& control, Budget budget, std::span<std::byte> scratch) noexcept
      : control_(control), budget_(budget), scratch_(scratch) {}

  [[nodiscard]] Budget budget() const noexcept { return budget_; }
  [[nodiscard]] Figures& figures() const noexcept { return control_.figures; }
  // Shared zeroed memory, page-aligned, of Workload::scratchBytes.
  [[nodiscard]] std::span<std::byte> scratch() const noexcept { return scratch_; }

  // Called by the server when it accepts requests, with its port, if it has one.
  void ready(std::uint16_t port = 0) const noexcept;
  // For the requester: the server's port.
  [[nodiscard]] std::uint16_t port() const noexcept {
    return static_cast<std::uint16_t>(control_.port.load(std::memory_order_relaxed));
  }
  // Called by the server after it has received a request and before it replies. True: this reply is
  // the last one.
  [[nodiscard]] bool stopping() const noexcept {
    return control_.stopping.load(std::memory_order_relaxed) != 0;
  }
  // Called by the requester: the next request is the last one.
  void stop() const noexcept { control_.stopping.store(1, std::memory_order_relaxed); }

  // Called by the requester: what it waits for from now on, for the message that it did not end in
  // time; and how many of them it has got.
  void waitsFor(std::string_view what) const noexcept;
  void got(std::uint64_t count) const noexcept {
    control_.got.store(count, std::memory_order_relaxed);
  }

  // Called by the server: it has received `count` one-way messages so far.
  void consumed(std::uint64_t count) const noexcept {
    control_.consumed.store(count, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t consumedCount() const noexcept {
    return control_.consumed.load(std::memory_order_relaxed);
  }

 private:
  Control& control_;
  Budget budget_;
  std::span<std::byte> scratch_;
};

struct Workload {
  std::function<void(const RunContext&)> server;  // may be empty
  std::function<void(const RunContext&)> requester;  // starts when the server is ready
  std::size_t scratchBytes = 0;
  bool stopsByItself = false;  // the server ends by itself soon after stop()
  Nanoseconds stopGrace = std::chrono::milliseconds(500);  // how soon; then it is killed
  Nanoseconds grace = std::chrono::seconds(15);  // beyond the budget, to connect and to end
};

struct Outcome {
  Figures figures;
  std::string error;  // empty after success
};

class Stage {
 public:
  Stage(Placement placement, Budget budget) noexcept
      : placement_(std::move(placement)), budget_(budget) {}

  // Returns within the budget plus twice the workload's grace plus one second, even if the
  // processes hang.
  [[nodiscard]] Outcome run(const Workload& workload) const;

  [[nodiscard]] Budget budget() const noexcept { return budget_; }
  [[nodiscard]] const Placement& placement() const noexcept { return placement_; }

 private:
  Placement placement_;
  Budget budget_;
};

}  // namespace mpf::bench
