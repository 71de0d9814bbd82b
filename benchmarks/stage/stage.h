// SPDX-License-Identifier: MIT
// Stage: runs one measurement in two processes of its own, each pinned to a CPU, and brings the
// figures back.
//
//   runner ── fork ──► server     serve, say ready() when requests may come, go on until killed or stopping()
//      └───── fork ──► requester  measures, fills the Figures
//
// The runner starts no thread and maps nothing of what it measures: a peer that crashes, hangs or
// leaks does so in its two processes.
//
// Threads  the runner's only one.
// Crash    either process that dies or overruns the time limit ends the measurement with an error;
//          both are killed by pid.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
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

// How long a measurement takes.
struct Budget {
  Nanoseconds warmUp{};
  Nanoseconds measure{};
};

inline constexpr double kNotLookedAt = -1;

// Answers over serial lines that were not whole, and how many of them had which fault, as their
// replies say; one may have several.
struct LineFaultFigures {
  double shortAnswers = kNotLookedAt;
  double overruns = 0;
  double parity = 0;
  double framing = 0;
  double breaks = 0;
};

// What the requester found out. Plain data in shared memory.
struct Figures {
  LatencyRecorder latency;  // each message timed by itself
  double typicalNs = 0;  // a message, in the middle one of many groups that were timed as a whole
  std::uint64_t count = 0;  // of what `perSecond` counts
  double perSecond = 0;  // 0: not a rate
  double value = 0;  // in the measurement's own unit
  double writesPerSecond = kNotLookedAt;  // system calls that write; see Meter
  // share of time that the server's CPUs had nothing to do, 0 to 1
  double idleServer = kNotLookedAt;
  double idleRequester = kNotLookedAt;  // the same of the requester's
  LineFaultFigures lineFaults{};  // of serial lines
  // what else a row finds out that several rows tell of; from its last round
  std::array<double, 4> more{};
};

// Shared by the processes of one measurement.
struct
    Control {  // NOLINT(clang-analyzer-optin.performance.Padding): each word on a line of its own
  alignas(kLineBytes) std::atomic<std::uint32_t> ready{0};  // written by the server
  std::atomic<std::uint32_t> port{0};  // written by the server, before `ready`
  alignas(kLineBytes) std::atomic<std::uint32_t> stopping{0};  // written by the requester
  // written by the server: one-way messages taken
  alignas(kLineBytes) std::atomic<std::uint64_t> consumed{0};
  alignas(kLineBytes) Figures figures;  // written by the requester
  std::array<std::array<char, 240>, 2> errors{};  // of server and requester, each written by itself
};

// What a process of a measurement sees of it.
class Scene {
 public:
  Scene(Control& control, Budget budget, std::span<std::byte> scratch) noexcept
      : control_(control), budget_(budget), scratch_(scratch) {}

  [[nodiscard]] Budget budget() const noexcept { return budget_; }
  [[nodiscard]] Figures& figures() const noexcept { return control_.figures; }
  // Shared zeroed memory, page-aligned, as large as was asked for.
  [[nodiscard]] std::span<std::byte> scratch() const noexcept { return scratch_; }

  // Server: requests may come; at this port, if it has one.
  void ready(std::uint16_t port = 0) const noexcept;
  // Requester: the server's port.
  [[nodiscard]] std::uint16_t port() const noexcept {
    return static_cast<std::uint16_t>(control_.port.load(std::memory_order_relaxed));
  }
  // Server: look after a request is there and before the reply leaves. True: this reply is the
  // last.
  [[nodiscard]] bool stopping() const noexcept {
    return control_.stopping.load(std::memory_order_relaxed) != 0;
  }
  // Requester: the next request is the last.
  void stop() const noexcept { control_.stopping.store(1, std::memory_order_relaxed); }

  // Server: `count` one-way messages have been taken so far.
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

struct Act {
  std::function<void(const Scene&)> server;  // may be empty
  std::function<void(const Scene&)> requester;  // starts when the server is ready
  std::size_t scratchBytes = 0;
  bool stopsByItself = false;  // the server leaves after stop(), and gets a moment to do so
  Nanoseconds grace = std::chrono::seconds(15);  // beyond the budget: connecting, tearing down
};

struct Outcome {
  Figures figures;
  std::string error;  // empty: all went well
};

class Stage {
 public:
  Stage(Placement placement, Budget budget) noexcept
      : placement_(std::move(placement)), budget_(budget) {}

  // Returns in less than the budget, twice the act's grace and a second, whatever the processes do.
  [[nodiscard]] Outcome run(const Act& act) const;

  [[nodiscard]] Budget budget() const noexcept { return budget_; }
  [[nodiscard]] const Placement& placement() const noexcept { return placement_; }

 private:
  Placement placement_;
  Budget budget_;
};

}  // namespace mpf::bench
