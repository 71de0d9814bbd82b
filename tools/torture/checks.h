// SPDX-License-Identifier: MIT
// Checks of what must hold on a backplane after a process has died or stalled.
//
// Threads  one.
// Trust    a segment that cannot be read counts as stale.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpf::torture {

// An invariant does not hold. The text says which one, and how that was detected.
class Broken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Segments of a backplane that belong to no living process. If more than `links` links exist, the
// last entry says so.
[[nodiscard]] std::vector<std::string> staleSegments(const std::string& backplane,
                                                     std::size_t links);

// Incarnation of the window of the server with this name, at location 0; 0 if it has none.
[[nodiscard]] std::uint64_t incarnationOf(const std::string& backplane, const std::string& server);
// Throws Broken when a process of the backplane has counted protocol errors of a peer.
void checkNoProtocolErrors(const std::string& backplane);
// Links that the server with this name has not closed.
[[nodiscard]] std::uint64_t openLinks(const std::string& backplane, const std::string& server);
// How many clients of the server with this name have died.
[[nodiscard]] std::uint64_t clientsDied(const std::string& backplane, const std::string& server);

// The resources that a process holds.
struct Holdings {
  std::size_t descriptors = 0;
  std::size_t mappings = 0;  // of shared memory
  std::size_t heapKiB = 0;   // resident private memory
  static Holdings of(pid_t pid);
};

}  // namespace mpf::torture
