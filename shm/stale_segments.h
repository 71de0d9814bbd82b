// SPDX-License-Identifier: MIT
// Stale segments: finds the files that dead processes left on a backplane, and removes them.
// Reports and removals use the same verdicts.
//
//   1. windows, hints         dead if their lock is free
//   2. links, pending binds   dead if the window of their client is dead
//   3. pools, FIFOs           dead if their link or the hints of their window are dead
//
// Threads  any.
// Crash    a dead file stays dead, so any number of processes may remove it at the same time.
// Trust    a file that cannot be opened, or has another layout version, is not judged and stays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mpf::stale_segments {

enum class Verdict { alive, dead, unknown };

struct Judged {
  std::string name;
  Verdict verdict{};
  std::string reason;  // the evidence for the verdict
};

// Judges every file of a backplane: windows and hints first, then the files that belong to them. A
// file that is removed during the call may be missing.
std::vector<Judged> judge(const std::string& backplane);

// As judge(), but if there are more than `most` files, judges `most` of them, chosen at random. Any
// user may fill /dev/shm with names, and a process that attaches must not wait for all of them. The
// choice omits names that MPF does not give, and pools whose link exists but was not chosen.
std::vector<Judged> judgeSome(const std::string& backplane, std::size_t most);

// Removes a file that was found dead. Returns false if another process has removed it or this user
// may not.
bool tryRemove(const Judged& file);

// If the owner of the window `name` with this incarnation is proven dead, removes the window, its
// hints, its FIFO and its fan-out pool.
void removeDeadWindow(const std::string& backplane, const std::string& name,
                      std::uint64_t incarnation);

}  // namespace mpf::stale_segments
