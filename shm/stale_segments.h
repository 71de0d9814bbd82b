// SPDX-License-Identifier: MIT
// Remains: what dead processes left on a backplane, file by file, and how that is known. Who
// removes it and who only wants to know what would be removed ask the same judge.
//
//   names ─► windows, hints: is their lock free? ─► links, pending binds: does their window live? ─► pools: their link? pipes: their hints?
//
// Threads  any.
// Crash    death is for good: what was found dead stays so until it is removed, by whomever, and
//          however many try at once.
// Trust    what may not be opened or is of another version is not judged, and stays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mpf::stale_segments {

enum class Verdict { alive, dead, unknown };

struct Judged {
  std::string name;
  Verdict verdict{};
  std::string reason;  // how that is known
};

// Every file of a backplane: windows and hints first, then what hangs on them. One that goes away
// meanwhile may be missing.
std::vector<Judged> judge(const std::string& backplane);

// The same of `most` files, chosen at random, when there are more. Any user may fill /dev/shm with
// names, and whoever begins work here must not wait for all of them. Names that MPF does not give
// are left out, and pools whose link was not chosen.
std::vector<Judged> judgeSome(const std::string& backplane, std::size_t most);

// Removes a file that was found dead. False: somebody was quicker, or this user may not.
bool tryRemove(const Judged& file);

// Removes the window `name` with this incarnation, its hints and its pipe, if its owner is proven
// dead.
void removeDeadWindow(const std::string& backplane, const std::string& name,
                      std::uint64_t incarnation);

}  // namespace mpf::stale_segments
