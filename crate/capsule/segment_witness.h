// SPDX-License-Identifier: MIT
// SegmentWitness: holds the segments of servers open while they live, so that they can be read
// after a death: clients remove the files of a dead server at once, but an open file stays.
//
//   watch(pid) ─► look(), look(), ... opens new segments ─► the process dies ─► find(pid) ─► pread
//
// Threads  one.
// Crash    holds descriptors only; nothing is left when the witness ends.
// Trust    files may contain anything. They are opened read-only and never mapped, and only the
//          window that belongs to the user of the process counts as its own.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <mpf/file_descriptor.h>

#include "shm/segment_name.h"
#include "tools/tap/name_watch.h"

namespace mpf::crate {

struct WitnessedLink {
  std::string name;  // of the segment
  FileDescriptor file;
  std::string client;  // label or program; empty: unknown
  std::int32_t clientPid = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, FileDescriptor> bulks;  // by side and number
};

// A server window.
struct WitnessedWindow {
  std::string name;  // of the segment
  FileDescriptor file;
  std::map<std::uint64_t, WitnessedLink> links;  // by incarnation
  std::uint64_t linksLeftOut = 0;  // closed, although the server lived: the limit was reached
};

struct WitnessedProcess {
  std::uint64_t startTicks = 0;  // identifies the process together with its pid
  std::map<std::uint64_t, WitnessedWindow> windows;  // by incarnation
};

class SegmentWitness {
 public:
  // maxFiles: the largest number of descriptors; above it, the links that were opened first are
  // given up. Throws std::invalid_argument for a name that no backplane can have.
  explicit SegmentWitness(std::string backplane, std::size_t maxFiles = 512);

  // Call after the start of a process, and after its death when it has been read.
  void watch(pid_t pid, std::uint64_t startTicks);
  void forget(pid_t pid);

  // Readable when look() should be called; -1: call it periodically.
  [[nodiscard]] int descriptor() const noexcept { return names_.descriptor(); }
  // Opens new segments, and closes those that were removed while their server lived. The second
  // needs a call from time to time, even if the descriptor is not readable.
  void look();

  // nullptr when the process is not watched.
  [[nodiscard]] const WitnessedProcess* find(pid_t pid) const;
  [[nodiscard]] std::size_t files() const noexcept;

 private:
  void openWindow(const std::string& name);
  void openLink(const std::string& name, const SegmentName::Parsed& parsed);
  void openBulk(const std::string& name, const SegmentName::Parsed& parsed);
  void closeRemoved();
  void makeRoom();
  WitnessedWindow* findWindow(std::uint64_t incarnation);

  std::string backplane_;
  std::size_t maxFiles_;
  tools::NameWatch names_;
  bool isScanDue_ = true;  // names may have appeared that names_ does not report
  std::map<pid_t, WitnessedProcess> processes_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> order_;  // window and link; oldest first
};

}  // namespace mpf::crate
