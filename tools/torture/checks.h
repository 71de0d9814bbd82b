// SPDX-License-Identifier: MIT
// Checks: what must hold on a backplane when a process has died or stalled.
//
// Threads  one.
// Trust    reads segments as every reader does; what cannot be read is a finding.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpf::torture {

// An invariant that does not hold; the text says which and how that was seen.
class Broken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Segments of a backplane that belong to nobody who lives, and links beyond those that `links`
// clients have.
[[nodiscard]] std::vector<std::string> staleSegments(const std::string& backplane,
                                                     std::size_t links);

// Throws Broken when a living process of the backplane has read nonsense from a peer.
void checkNoNonsense(const std::string& backplane);
// How often a server with this name saw clients die.
[[nodiscard]] std::uint64_t clientsDied(const std::string& backplane, const std::string& server);

// What a process holds.
struct Holdings {
  std::size_t descriptors = 0;
  std::size_t mappings = 0;  // of shared memory
  std::size_t heapKiB = 0;  // resident memory that is nobody else's
  static Holdings of(pid_t pid);
};

}  // namespace mpf::torture
