// SPDX-License-Identifier: MIT
// Measurement: one row of the table. Result: the same row after it was measured.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/disturbance.h"
#include "benchmarks/stage/mode.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {

struct Measurement {
  std::string setting;   // the surroundings of the row and of its floor
  std::string question;  // the heading in the table
  std::string name;
  Mode mode = Mode::spin;
  std::size_t bytes = 0;
  bool touched = false;
  std::string detail;      // "100 outstanding"
  std::string floorName;   // the row that this one is divided by; empty: none
  std::size_t floorBytes = 0;
  std::string unit;        // of Figures::value; empty when the row is a latency or a rate
  std::string skipped;     // why the row is left out
  double share = 1.0;      // duration, relative to that of a normal row
  bool isSlow = false;     // needs seconds to set up, and is measured in one round only
  // Successive rows with the same environmentName share the environment.
  std::function<std::unique_ptr<Environment>()> environment;
  std::string environmentName;
  std::function<Outcome(const Stage&)> run;
};

// Nanoseconds per message: from a rate, or the typical time, or p50 where no groups were timed; 0
// without any of them.
[[nodiscard]] double costNs(const Figures& figures) noexcept;

struct Result {
  Measurement measurement;
  Figures figures;
  std::string error;
  std::size_t rounds = 0;   // that count: see local/rounds.h
  double floorNs = 0;       // a message of the floor, measured in the rounds of the row
  double ratioToFloor = 0;  // above 1: slower than the floor; 0: the row has no floor
  // Of more than half of the floor's values, those closest to each other: the highest divided by
  // the lowest one. 0: it was measured at most once.
  double floorDrift = 0;
  // The longest time of a cache line beside the row and its floor divided by the shortest one:
  // median of the rounds. 0: not measured.
  double lineDrift = 0;
  bool haveLinesMoved = false;  // no round was calm with the lines of the block
  Disturbance disturbance;  // of the rounds together

  [[nodiscard]] bool isGood() const noexcept {
    return measurement.skipped.empty() && error.empty();
  }
  [[nodiscard]] double costNs() const noexcept { return isGood() ? bench::costNs(figures) : 0; }
  [[nodiscard]] bool hasFloorMoved() const noexcept { return floorDrift > kLargeDrift; }
  [[nodiscard]] bool hadLessCpu() const noexcept { return disturbance.isLarge(measurement.mode); }
  // Whether this row is noise; see README.md, "Rows that were disturbed".
  [[nodiscard]] bool isDisturbed() const noexcept {
    return isGood() && (hadLessCpu() || hasFloorMoved() || haveLinesMoved);
  }

  static constexpr double kLargeDrift = 1.25;
  // A host that moves a processor changes it by more, and short measurements differ by less.
  static constexpr double kLargeLineDrift = 1.5;
};

// All rows of `mpf bench local`, in order, floors first.
//   runName  unique on this host: part of the names of sockets and segments
[[nodiscard]] std::vector<Measurement> catalogue(const std::string& runName);

// The rows of one source file each.
[[nodiscard]] std::vector<Measurement> floorMeasurements();
[[nodiscard]] std::vector<Measurement> peerMeasurements(const std::string& runName);
[[nodiscard]] std::vector<Measurement> scaleMeasurements(const std::string& runName);
[[nodiscard]] std::vector<Measurement> deathMeasurements(const std::string& runName);
[[nodiscard]] std::vector<Measurement> tappedMeasurements(const std::string& runName);
[[nodiscard]] std::vector<Measurement> fanOutMeasurements(const std::string& runName);
[[nodiscard]] std::vector<Measurement> oneThreadMeasurements(const std::string& runName);
// Uses rows of the first two.
[[nodiscard]] std::vector<Measurement> underLoadMeasurements(const std::string& runName);

inline constexpr const char* kBounce = "cache-line bounce";
inline constexpr const char* kFutexBounce = "futex bounce";
inline constexpr const char* kMemcpyBounce = "memcpy bounce";
inline constexpr const char* kFutexMemcpyBounce = "memcpy bounce, asleep";
inline constexpr const char* kRing = "bare slot ring";
inline constexpr const char* kLoadedFutexBounce = "futex bounce, busy CPUs";
inline constexpr const char* kUnixSocket = "Unix socket";
inline constexpr const char* kSmallRoundTrip = "Round trip of 4 B";

}  // namespace mpf::bench
