// SPDX-License-Identifier: MIT
#include "shm/owner_lock.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <optional>
#include <utility>

#include "shm/process.h"
#include "shm/segment.h"

namespace mpf::owner_lock {
namespace {

constexpr off_t kOwnersByte = 0;
constexpr off_t kReapersByte = 1;

struct flock64 lockOf(short type, off_t from, off_t bytes) noexcept {
  struct flock64 lock{};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = from;
  lock.l_len = bytes;
  return lock;
}

bool tryLock(int fd, short type, off_t from, off_t bytes) noexcept {
  auto lock = lockOf(type, from, bytes);
  return ::fcntl(fd, F_OFD_SETLK, &lock) == 0;
}

// Finds a write lock of another open file on this byte; nullopt on an error. The query for a read
// lock reports only write locks. `l_type` is F_UNLCK if there is no such lock.
std::optional<struct flock64> findWriteLock(int fd, off_t byte) noexcept {
  auto lock = lockOf(F_RDLCK, byte, 1);
  if (::fcntl(fd, F_OFD_GETLK, &lock) != 0) return std::nullopt;
  return lock;
}

// Opens a reaper file and locks it. Returns an empty descriptor if another reaper holds the lock or
// the file cannot be opened.
FileDescriptor lockReaperFile(const std::string& name, int flags) {
  const auto path = segments::path(name);
  constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  FileDescriptor file(::open(path.c_str(), kFlags | flags, 0600));
  struct stat opened{};
  struct stat named{};
  if (!file || !tryLock(file.get(), F_WRLCK, 0, 0)) return {};
  // The previous reaper may have removed the name after we opened the file. Other reapers would
  // then lock another file of this name, so the lock on this one is worthless.
  if (::fstat(file.get(), &opened) != 0 || ::lstat(path.c_str(), &named) != 0) return {};
  if (!S_ISREG(opened.st_mode) || opened.st_ino != named.st_ino) return {};
  return file;
}

// A write lock on exactly this byte belongs to a reaper, which is removing the name.
bool isReapers(const struct flock64& lock) noexcept {
  return lock.l_type == F_WRLCK && lock.l_start == kReapersByte && lock.l_len == 1;
}

bool isReaperFileLocked(const std::string& name) {
  const FileDescriptor file(
      ::open(segments::path(name).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  return file && isHeld(file.get());
}

}  // namespace

// Length 0 locks up to the end of the file, even if the file becomes longer.
bool trySet(int fd) noexcept { return tryLock(fd, F_WRLCK, 0, 0); }

bool isHeld(int fd) noexcept {
  const auto lock = findWriteLock(fd, kOwnersByte);
  if (!lock) return true;
  // The kernel reports pid -1 for open file description locks, which owners use. A lock with a pid
  // is a traditional lock of a process, so it is not an owner's lock.
  return lock->l_type == F_WRLCK && lock->l_pid == -1;
}

bool isHeldByOwner(int fd, const layout::SegmentHeader& header) noexcept {
  return isHeld(fd) && !Process::hasEnded(header);
}

Reaper::Reaper(const FileDescriptor& file, std::string reaperFile)
    : reaperFile_(std::move(reaperFile)) {
  const bool isAlone = tryLock(file.get(), F_WRLCK, kReapersByte, 1);
  if (reaperFile_.empty()) {
    mayRemove_ = isAlone;
  } else {
    mayRemove_ = isAlone ? !isReaperFileLocked(reaperFile_) : tryBesideStrangers(file.get());
  }
}

Reaper::~Reaper() {
  if (ownLock_) segments::remove(reaperFile_);
}

bool Reaper::tryBesideStrangers(int fd) {
  // Look before locking the reaper file: a reaper that finds it locked gives up, and so would we.
  auto writer = findWriteLock(fd, kReapersByte);
  if (!writer || isReapers(*writer)) return false;
  ownLock_ = lockReaperFile(reaperFile_, O_CREAT);
  if (!ownLock_) return false;
  // A process of root gives the file to the window's user, so that processes of that user can open
  // it if the process of root is killed.
  struct stat window{};
  if (::fstat(fd, &window) == 0 && ::geteuid() == 0)
    static_cast<void>(::fchown(ownLock_.get(), window.st_uid, window.st_gid) == 0);
  writer = findWriteLock(fd, kReapersByte);
  return writer && !isReapers(*writer);
}

bool removeReaperFile(const std::string& name) {
  const auto lock = lockReaperFile(name, 0);
  return lock && segments::remove(name);
}

}  // namespace mpf::owner_lock
