// SPDX-License-Identifier: MIT
#include "shm/doorbell.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>

#include "base/step.h"
#include "base/system_call.h"
#include "base/timespec.h"
#include "shm/segment.h"

namespace mpf::doorbell {

void sleep(const layout::Word32& bell, std::uint32_t seen, Deadline deadline) noexcept {
  const auto until = timespecOf(deadline.ns());
  // FUTEX_WAIT_BITSET: an absolute CLOCK_MONOTONIC deadline, so that restarts after signals do not
  // stretch the wait.
  ::syscall(SYS_futex, &bell, FUTEX_WAIT_BITSET, seen, deadline.isNever() ? nullptr : &until,
            nullptr, FUTEX_BITSET_MATCH_ANY);
}

void ring(layout::Word32& bell) noexcept {
  // PAIR(bell): an owner that saw this ring before it slept has also seen the message behind it.
  bell.fetch_add(1, std::memory_order_release);
  MPF_STEP(bell_changed);
  ::syscall(SYS_futex, &bell, FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

FileDescriptor createFifo(const std::string& name, mode_t mode, std::uint32_t group) {
  const auto path = segments::path(name);
  checkCall(::mkfifo(path.c_str(), 0600), "create", path);
  // Open for both directions: the read end never sees an end of file when a peer closes the FIFO.
  FileDescriptor fifo(
      checkCall(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC), "open", path));
  if (group != ~std::uint32_t{0})
    checkCall(::fchown(fifo.get(), static_cast<uid_t>(-1), group), "change the group of", path);
  checkCall(::fchmod(fifo.get(), mode), "change the rights of", path);
  return fifo;
}

FileDescriptor tryOpenFifo(const std::string& name) noexcept {
  // For reading, too: a write must not raise SIGPIPE when the owner has died.
  FileDescriptor fifo(::open(segments::pathText(name.c_str()).data(),
                             O_RDWR | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));
  struct stat status{};
  // Any process may have created a file of another kind under this name.
  if (fifo && (::fstat(fifo.get(), &status) != 0 || !S_ISFIFO(status.st_mode))) fifo.reset();
  return fifo;
}

bool tryRingFifo(const FileDescriptor& fifo) noexcept {
  const char one = 1;
  return ::write(fifo.get(), &one, 1) == 1 || errno == EAGAIN;  // a full FIFO is readable already
}

void drainFifo(const FileDescriptor& fifo) noexcept {
  constexpr int kMostReads = 256;  // 1 MiB, as long as the FIFO of an ordinary user can be
  std::array<char, 4096> discarded;
  // A read that does not fill the buffer has emptied the FIFO. A byte that is written later makes
  // the FIFO readable again. Peers may write without end, so the number of reads is limited.
  for (int reads = 0; reads < kMostReads; ++reads) {
    if (::read(fifo.get(), discarded.data(), discarded.size()) <
        static_cast<ssize_t>(discarded.size()))
      return;
  }
}

}  // namespace mpf::doorbell
