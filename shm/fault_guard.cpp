// SPDX-License-Identifier: MIT
#include "shm/fault_guard.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <mutex>
#include <utility>

#include "base/system_call.h"
#include "shm/reserve.h"

#ifdef __SANITIZE_THREAD__
extern "C" {
void AnnotateIgnoreWritesBegin(const char* file, int line);
void AnnotateIgnoreWritesEnd(const char* file, int line);
}
#endif

namespace mpf::fault_guard {

struct Range {
  std::atomic<std::uintptr_t> begin{0};  // 0: free
  std::atomic<std::size_t> bytes{0};
  std::atomic<bool> writable{false};
  std::atomic<bool> lost{false};
  std::atomic<int> file{-1};     // descriptor that grows the file; -1: none
  std::atomic<ino_t> inode{0};   // inode of the file at `path`; 0: `path` is not set
  std::array<char, 128> path{};  // path at which the file is opened and grown
  Range* nextFree = nullptr;     // under tableMutex
};

namespace {

// Blocks are never freed, so that a signal handler can walk their ranges at any time.
struct Block {
  std::array<Range, 256> ranges;
  Block* next = nullptr;
};

std::mutex tableMutex;  // protects changes of the table; signal handlers never lock it
std::atomic<Block*> blocks{nullptr};
Range* freeRanges = nullptr;  // under tableMutex
struct sigaction previousAction{};

Range* findFaulty(std::uintptr_t address) noexcept {
  // PAIR(guard-block): also sees the ranges of the block, and the older blocks.
  for (auto* block = blocks.load(std::memory_order_acquire); block != nullptr;
       block = block->next) {
    for (auto& range : block->ranges) {
      // PAIR(guarded-range): also sees the length and the kind of the range.
      const auto begin = range.begin.load(std::memory_order_acquire);
      if (begin != 0 && address >= begin &&
          address - begin < range.bytes.load(std::memory_order_relaxed))
        return &range;
    }
  }
  return nullptr;
}

bool tryGrow(const Range& range) noexcept {
  const auto bytes = range.bytes.load(std::memory_order_relaxed);
  if (const int file = range.file.load(std::memory_order_relaxed); file >= 0)
    return reserve(file, bytes) == 0;
  // PAIR(guard-path): also sees the path.
  const auto inode = range.inode.load(std::memory_order_acquire);
  if (inode == 0) return false;
  const int file = ::open(range.path.data(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return false;
  struct stat status{};
  const bool grown =
      ::fstat(file, &status) == 0 && status.st_ino == inode && reserve(file, bytes) == 0;
  ::close(file);
  return grown;
}

// Calls mmap() without the check of ThreadSanitizer, for which mmap() writes to the whole range and
// races with the threads that read it. Those threads see the old contents or zeroes.
void* mapZeroes(void* data, std::size_t bytes, int protection) noexcept {
#ifdef __SANITIZE_THREAD__
  AnnotateIgnoreWritesBegin(__FILE__, __LINE__);
#endif
  auto* const mapped =
      ::mmap(data, bytes, protection, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
#ifdef __SANITIZE_THREAD__
  AnnotateIgnoreWritesEnd(__FILE__, __LINE__);
#endif
  return mapped;
}

// Replaces the mapping of a file by zeroes, atomically for all threads.
bool tryReplace(Range& range) noexcept {
  const int protection =
      PROT_READ | (range.writable.load(std::memory_order_relaxed) ? PROT_WRITE : 0);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the address that was mapped
  auto* const data = reinterpret_cast<void*>(range.begin.load(std::memory_order_relaxed));
  const auto bytes = range.bytes.load(std::memory_order_relaxed);
  if (mapZeroes(data, bytes, protection) == MAP_FAILED) return false;
  range.lost.store(true, std::memory_order_relaxed);
  return true;
}

// Does what would happen without our handler: calls the previous handler or the default action.
void passOn(int signal, siginfo_t* fault, void* context) {
  if ((previousAction.sa_flags & SA_SIGINFO) != 0)
    return previousAction.sa_sigaction(signal, fault, context);
  const bool isSent = fault->si_code <= 0;  // sent by a process, not caused by an access
  if (previousAction.sa_handler == SIG_IGN && isSent) return;
  if (previousAction.sa_handler != SIG_DFL && previousAction.sa_handler != SIG_IGN)
    return previousAction.sa_handler(signal);
  ::signal(signal, SIG_DFL);
  if (isSent) ::raise(signal);  // a faulty access is repeated, and raises the signal again
}

void onFault(int signal, siginfo_t* fault, void* context) {
  if (!tryRepair(*fault)) passOn(signal, fault, context);
}

int openNothing() noexcept { return ::open("/dev/null", O_RDWR | O_CLOEXEC); }

// Runs in the child of a fork. Replaces the child's copies of the parent's mappings by private
// memory, and gives up its copies of the parent's locks: their descriptors, whose numbers still
// have owners, refer to nothing afterwards.
void leaveToParent() noexcept {
  const int spare = openNothing();
  int nothing = spare;
  // PAIR(guard-block): also sees the ranges of the block, and the older blocks.
  for (auto* block = blocks.load(std::memory_order_acquire); block != nullptr;
       block = block->next) {
    for (auto& range : block->ranges) {
      if (range.begin.load(std::memory_order_relaxed) == 0) continue;
      const int file = range.file.exchange(-1, std::memory_order_relaxed);
      if (file >= 0 && nothing >= 0) {
        ::dup3(nothing, file, O_CLOEXEC);
      } else if (file >= 0) {  // no descriptor is free: the next one gets the number of this one
        ::close(file);
        nothing = openNothing();
      }
      range.inode.store(0, std::memory_order_relaxed);
      tryReplace(range);
    }
  }
  ::close(spare);
}

void watchForks() {
  const auto lock = [] { tableMutex.lock(); };
  const auto unlock = [] { tableMutex.unlock(); };
  const auto unlockInChild = [] {
    leaveToParent();
    tableMutex.unlock();
  };
  if (const int error = ::pthread_atfork(lock, unlock, unlockInChild); error != 0)
    throwSystemError(error, "pthread_atfork", {});
}

bool install() {
  watchForks();
  checkCall(::sigaction(SIGBUS, nullptr, &previousAction), "sigaction");
  struct sigaction action{};
  action.sa_sigaction = onFault;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESTART;
  action.sa_mask = previousAction.sa_mask;
  checkCall(::sigaction(SIGBUS, &action, nullptr), "sigaction");
  return true;
}

// Under tableMutex.
Range& takeFree() {
  if (freeRanges == nullptr) {
    auto* const block = new Block;
    block->next = blocks.load(std::memory_order_relaxed);
    for (auto& range : block->ranges) range.nextFree = std::exchange(freeRanges, &range);
    // PAIR(guard-block): the block is complete.
    blocks.store(block, std::memory_order_release);
  }
  return *std::exchange(freeRanges, freeRanges->nextFree);
}

}  // namespace

Range* add(void* data, std::size_t bytes, bool writable) {
  [[maybe_unused]] static const bool kInstalled = install();
  const std::lock_guard lock(tableMutex);
  auto& range = takeFree();
  range.bytes.store(bytes, std::memory_order_relaxed);
  range.writable.store(writable, std::memory_order_relaxed);
  range.lost.store(false, std::memory_order_relaxed);
  range.file.store(-1, std::memory_order_relaxed);
  range.inode.store(0, std::memory_order_relaxed);
  // PAIR(guarded-range): the length and the kind are stored before.
  range.begin.store(reinterpret_cast<std::uintptr_t>(data), std::memory_order_release);
  return &range;
}

void remove(Range* range) noexcept {
  range->begin.store(0, std::memory_order_relaxed);
  const std::lock_guard lock(tableMutex);
  range->nextFree = std::exchange(freeRanges, range);
}

void growBy(Range& range, int file) noexcept { range.file.store(file, std::memory_order_relaxed); }

void growAt(Range& range, int file, const std::string& path) noexcept {
  struct stat status{};
  if (path.size() >= range.path.size() || ::fstat(file, &status) != 0) return;
  path.copy(range.path.data(), path.size());
  range.path[path.size()] = '\0';
  // PAIR(guard-path): the path is stored before.
  range.inode.store(status.st_ino, std::memory_order_release);
}

const std::atomic<bool>& lossOf(const Range& range) noexcept { return range.lost; }

bool tryRepair(const siginfo_t& fault) noexcept {
  if (fault.si_code != BUS_ADRERR) return false;
  const int before = errno;
  auto* const range = findFaulty(reinterpret_cast<std::uintptr_t>(fault.si_addr));
  const bool repaired = range != nullptr && (tryGrow(*range) || tryReplace(*range));
  errno = before;
  return repaired;
}

}  // namespace mpf::fault_guard
