// SPDX-License-Identifier: MIT
#include "benchmarks/peers/iceoryx_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <grp.h>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> locksIn(const fs::path& folder) {
  std::vector<fs::path> locks;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    const auto& path = entry->path();
    if (path.extension() == ".lock" && path.filename().string().starts_with(kRunPrefix))
      locks.push_back(path);
  }
  return locks;
}

// Takes the lock of a dead process. Empty when a process holds it, or the file does not exist.
FileDescriptor tryLock(const fs::path& path) {
  FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
  if (file && ::flock(file.get(), LOCK_EX | LOCK_NB) != 0) file.reset();
  return file;
}

void removeFile(const fs::path& path) {
  std::error_code ignored;
  fs::remove(path, ignored);
}

void removeSocket(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_socket(path, ignored)) removeFile(path);
}

}  // namespace

void removeIceoryxFiles(const fs::path& folder) {
  for (auto lock : locksIn(folder)) {
    const auto held = tryLock(lock);
    if (!held) continue;
    removeFile(lock);
    removeSocket(lock.replace_extension());
  }
}

void removeRouDiFiles(const fs::path& folder, const fs::path& sharedMemory) {
  // No other RouDi can start while this process holds the lock.
  const auto held = tryLock(folder / "iox-unique-roudi.lock");
  if (!held) return;
  removeFile(sharedMemory / "iceoryx_mgmt");
  if (const auto* group = ::getgrgid(::getegid()); group != nullptr)
    removeFile(sharedMemory / group->gr_name);
  removeSocket(folder / "roudi");
  removeFile(folder / "roudi.lock");
  removeFile(folder / "iox-unique-roudi.lock");
}

}  // namespace mpf::bench
