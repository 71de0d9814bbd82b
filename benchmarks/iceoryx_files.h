// SPDX-License-Identifier: MIT
// Files that iceoryx leaves in the temporary folder when a process of a measurement is killed: for each, a lock NAME.lock and a socket NAME.
#pragma once

#include <filesystem>

namespace mpf::bench {

// Removes those of processes that are gone, of this run and of earlier ones: their names begin with kRunPrefix, and nobody holds the lock.
void removeIceoryxFiles(const std::filesystem::path& folder);

}  // namespace mpf::bench
