// SPDX-License-Identifier: MIT
// Files that iceoryx leaves: of each process of a measurement, which is killed, and of its daemon
// RouDi, which ends without removing them when its clients were killed. Each process has a lock
// NAME.lock and a socket NAME in the temporary folder, the daemon segments, too.
#pragma once

#include <filesystem>

namespace mpf::bench {

// Removes those of processes that are gone, of this run and of earlier ones: their names begin with
// kRunPrefix, and nobody holds the lock.
void removeIceoryxFiles(const std::filesystem::path& folder);

// Removes those of a RouDi that ran as this user and is gone, which nobody holds the lock of.
void removeRouDiFiles(const std::filesystem::path& folder,
                      const std::filesystem::path& sharedMemory);

}  // namespace mpf::bench
