// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/model_wires.h>

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstddef>
#include <fmt/format.h>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>

#include "base/signals_blocked.h"
#include "base/system_call.h"

namespace mpf {
namespace {

constexpr std::uint64_t kMagic = 0x7365726977'66706d;  // "mpfwires", read as a little-endian number
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kCapacity = 1024;
constexpr std::size_t kNameBytes = 44;

}  // namespace

struct ModelWiresFile {
  struct Wire {
    std::atomic<std::uint32_t> isNamed{0};  // 1 once the name is complete; then never 0 again
    std::array<char, kNameBytes> name{};  // ends with a zero
    std::atomic<std::uint64_t> value{0};  // the bits of a double
    std::uint64_t reserved = 0;

    // Returns the name; empty when it is invalid.
    [[nodiscard]] std::string_view text() const noexcept {
      const auto* const end = std::find(name.begin(), name.end(), '\0');
      return end == name.end()
                 ? std::string_view()
                 : std::string_view(name.data(), static_cast<std::size_t>(end - name.begin()));
    }
  };

  std::atomic<std::uint64_t> magic{0};  // written last
  std::uint32_t version = 0;
  std::uint32_t capacity = 0;
  // incremented at each change; the futex of waiting processes
  std::atomic<std::uint32_t> changes{0};
  std::array<std::uint32_t, 11> reserved{};
  std::array<Wire, kCapacity> wires{};

  void announce() noexcept {
    // PAIR(wire-changed): a reader of this number also sees the new value.
    changes.fetch_add(1, std::memory_order_release);
    ::syscall(SYS_futex, &changes, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  }
  // Waits until `changes` differs from `seen`.
  void waitForMore(std::uint32_t seen) noexcept {
    ::syscall(SYS_futex, &changes, FUTEX_WAIT, seen, nullptr, nullptr, 0);
  }
};
static_assert(offsetof(ModelWiresFile, changes) == 16 && offsetof(ModelWiresFile, wires) == 64);
static_assert(sizeof(ModelWiresFile::Wire) == 64 && offsetof(ModelWiresFile::Wire, value) == 48);
static_assert(std::is_standard_layout_v<ModelWiresFile> &&
              std::atomic<std::uint64_t>::is_always_lock_free);

namespace {

// A lock between processes, which hold it for microseconds, unless one is stopped meanwhile; the
// kernel releases it when the process ends.
class FileLock {
 public:
  FileLock(int fd, const std::string& path) : fd_(fd) {
    constexpr int kTries = 2000;  // counted, because a time would pass while the host is suspended
    for (int tries = 1; ::flock(fd, LOCK_EX | LOCK_NB) < 0; ++tries) {
      if (errno != EWOULDBLOCK && errno != EINTR) throwSystemError(errno, "lock", path);
      if (tries == kTries)
        throw std::runtime_error(
            fmt::format("{} is locked by another process, which may be stopped", path));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  ~FileLock() { ::flock(fd_, LOCK_UN); }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int fd_;
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw std::runtime_error(fmt::format(
      "{} is not a file of model wires: {}; remove it or name another file", path, why));
}

bool isWireName(std::string_view name) {
  return !name.empty() && name.size() < kNameBytes &&
         std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

bool isZero(const std::byte* bytes, std::size_t size) {
  return std::all_of(bytes, bytes + size, [](std::byte byte) { return byte == std::byte{0}; });
}

void check(const ModelWiresFile& file, const std::string& path) {
  if (file.version != kVersion)
    refuse(path, fmt::format("its version is {}, not {}", file.version, kVersion));
  if (file.capacity != kCapacity)
    refuse(path, fmt::format("its capacity is {} wires, not {}", file.capacity, kCapacity));
  for (std::size_t i = 0; i < kCapacity; ++i) {
    const auto& wire = file.wires[i];
    const auto isNamed = wire.isNamed.load(std::memory_order_relaxed);
    if (isNamed > 1 || (isNamed == 1 && !isWireName(wire.text())))
      refuse(path, fmt::format("wire {} has a damaged name", i));
  }
}

}  // namespace

void ModelWire::set(double value) const noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  if (value_->exchange(bits, std::memory_order_relaxed) != bits) file_->announce();
}

ModelWires::ModelWires(std::string path) : path_(std::move(path)) {
  fd_.reset(checkCall(::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600), "open", path_));
  const FileLock lock(fd_.get(), path_);
  map();
  try {
    prepare();
  } catch (...) {
    ::munmap(file_, sizeof(ModelWiresFile));
    throw;
  }
}

ModelWires::~ModelWires() { ::munmap(file_, sizeof(ModelWiresFile)); }

void ModelWires::map() {
  struct stat status{};
  checkCall(::fstat(fd_.get(), &status), "look at", path_);
  if (!S_ISREG(status.st_mode)) refuse(path_, "it is not a regular file");
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes != 0 && bytes != sizeof(ModelWiresFile))
    refuse(path_, fmt::format("it has {} bytes, not {}", bytes, sizeof(ModelWiresFile)));
  // Not ftruncate(): on a full disk, a write to the mapping would raise SIGBUS.
  if (bytes == 0) {
    const auto error = ::posix_fallocate(fd_.get(), 0, sizeof(ModelWiresFile));
    if (error != 0) throwSystemError(error, "make", path_);
  }
  auto* const mapped =
      ::mmap(nullptr, sizeof(ModelWiresFile), PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), 0);
  if (mapped == MAP_FAILED) throwSystemError(errno, "map", path_);
  file_ = static_cast<ModelWiresFile*>(mapped);
}

// Completes the header of a file that contains only zeroes, which is new or was left by a killed
// process.
void ModelWires::prepare() {
  // PAIR(wires-made): the rest of the header is complete.
  const auto magic = file_->magic.load(std::memory_order_acquire);
  if (magic == kMagic) return check(*file_, path_);
  const auto* const wires = reinterpret_cast<const std::byte*>(file_->wires.data());
  if (magic != 0 || !isZero(wires, sizeof file_->wires)) refuse(path_, "its contents are invalid");
  file_->version = kVersion;
  file_->capacity = kCapacity;
  // PAIR(wires-made): stored after the rest of the header.
  file_->magic.store(kMagic, std::memory_order_release);
}

ModelWire ModelWires::wire(std::string_view name) {
  if (!isWireName(name)) {
    throw std::invalid_argument(fmt::format(
        "\"{}\" is not a valid name of a wire; use 1 to {} printable characters without spaces",
        name, kNameBytes - 1));
  }
  const std::lock_guard inProcess(mutex_);
  const FileLock lock(fd_.get(), path_);
  for (auto& wire : file_->wires) {
    // PAIR(wire-named): the name is complete.
    if (wire.isNamed.load(std::memory_order_acquire) == 0) {
      wire.name = {};
      std::copy(name.begin(), name.end(), wire.name.begin());
      // PAIR(wire-named): stored after the name.
      wire.isNamed.store(1, std::memory_order_release);
    }
    if (wire.text() == name) return {*file_, wire.value};
  }
  throw std::runtime_error(
      fmt::format("{} already has {} wires, which is the limit: wire \"{}\" cannot be added", path_,
                  kCapacity, name));
}

ModelWireWatcher::ModelWireWatcher(ModelWires& wires, std::function<void()> changed)
    : file_(*wires.file_) {
  const SignalsBlocked blocked;
  // PAIR(wire-changed): every change after this is reported.
  auto seen = file_.changes.load(std::memory_order_acquire);
  thread_ =
      std::jthread([this, seen, changed = std::move(changed)](const std::stop_token& stop) mutable {
        for (;;) {
          file_.waitForMore(seen);
          // PAIR(wire-changed): the values of the changes up to this number are visible, and the
          // request to stop that the destructor has announced.
          const auto now = file_.changes.load(std::memory_order_acquire);
          if (stop.stop_requested()) return;
          if (std::exchange(seen, now) != now) changed();
        }
      });
}

ModelWireWatcher::~ModelWireWatcher() {
  thread_.request_stop();
  file_.announce();
}

}  // namespace mpf
