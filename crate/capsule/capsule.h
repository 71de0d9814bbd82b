// SPDX-License-Identifier: MIT
// Capsule: the crash report of a process, as one JSON document in one file.
//
//   SegmentWitness ─┐
//   Death ──────────┼─► capsuleOf() ─► CapsuleStore::add() ─► file ─► readCapsule() ─► mpf capsule
//   log of process ─┘
//
// The document has "mpfCapsule", the version of its format; when, host, crate, process, cause, the
// stacks of its core, the end of the log, and for each server: counters, latencies, the request in
// work ("handling"), and its links with their last messages.
//
// Threads  one, and no other in the process: see core_file.h.
// Trust    segments and files of capsules may contain anything. A capsule that is damaged is an
//          error that names the file and the problem.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "crate/capsule/segment_witness.h"

namespace mpf::crate {

inline constexpr int kCapsuleVersion = 1;

enum class CauseKind { signal, exit, stalled, busy, restarted, unknown };
[[nodiscard]] const char* toString(CauseKind kind) noexcept;

struct Cause {
  CauseKind kind = CauseKind::unknown;
  int number = 0;  // signal or exit status
  bool hasCore = false;
  // From the status of waitpid().
  [[nodiscard]] static Cause ofWaitStatus(int status) noexcept;
};

// What the supervisor knows about a process that died.
struct Death {
  std::string crate;
  std::string process;
  std::vector<std::string> command;
  pid_t pid = 0;
  std::int64_t startedNs = 0;  // CLOCK_MONOTONIC
  int restarts = 0;
  Cause cause;
  std::string log;  // path; empty: none
  std::string folder;  // in which it ran
};

struct CapsuleLimits {
  std::size_t messages = 16;  // of each ring
  std::size_t allMessages = 4096;  // of a server: with many links, each shows fewer, at least one
  std::size_t logBytes = std::size_t{64} << 10;
  std::chrono::milliseconds coreTime{3000};  // longest time for reading a core
};

// `witnessed` is nullptr when the process had no witness. Never throws because of invalid segments
// or an unreadable log: they are "problems" of the capsule.
[[nodiscard]] nlohmann::ordered_json capsuleOf(const Death& death,
                                               const WitnessedProcess* witnessed,
                                               const CapsuleLimits& limits = {});

// Reads a capsule.
//   throws  std::system_error; std::runtime_error that names the file and what is wrong with it
[[nodiscard]] nlohmann::ordered_json readCapsule(const std::string& path);

}  // namespace mpf::crate
