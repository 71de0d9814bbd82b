// SPDX-License-Identifier: MIT
#include <mpf/benchmarks/iceoryx_files.h>

#include <fcntl.h>
#include <sys/file.h>

#include <string>
#include <vector>

#include <mpf/base/file_descriptor.h>
#include <mpf/benchmarks/mpf_peer.h>

namespace mpf::bench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> locksIn(const fs::path& folder) {
  std::vector<fs::path> locks;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end; entry.increment(failure)) {
    const auto& path = entry->path();
    if (path.extension() == ".lock" && path.filename().string().starts_with(kRunPrefix)) locks.push_back(path);
  }
  return locks;
}

}  // namespace

void removeIceoryxFiles(const fs::path& folder) {
  for (auto lock : locksIn(folder)) {
    const FileDescriptor file(::open(lock.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
    if (!file || ::flock(file.get(), LOCK_EX | LOCK_NB) != 0) continue;
    std::error_code ignored;
    fs::remove(lock, ignored);
    const auto socket = lock.replace_extension();
    if (fs::is_socket(socket, ignored)) fs::remove(socket, ignored);
  }
}

}  // namespace mpf::bench
