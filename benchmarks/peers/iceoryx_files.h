// SPDX-License-Identifier: MIT
// Removes files that iceoryx leaves: those of killed processes of a measurement, and those of its
// daemon RouDi, which does not remove them when its clients were killed. Each process has a lock
// NAME.lock and a socket NAME in the temporary folder; the daemon also has segments.
#pragma once

#include <filesystem>

namespace mpf::bench {

// Removes the files of dead processes of this run and of earlier runs: their names begin with
// kRunPrefix, and no process holds their lock.
void removeIceoryxFiles(const std::filesystem::path& folder);

// Removes the files of a dead RouDi of this user, if no process holds its lock.
void removeRouDiFiles(const std::filesystem::path& folder,
                      const std::filesystem::path& sharedMemory);

}  // namespace mpf::bench
