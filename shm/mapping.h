// SPDX-License-Identifier: MIT
// Mapping: a shared file mapped into this process, guarded against peers that truncate it.
//
// Threads  one thread constructs and destroys it; any thread may use the memory.
// Crash    the kernel unmaps the memory.
// Trust    a peer that may write the file may truncate it. The guard then grows the file again, or
//          replaces the memory by zeroes and isLost() is true (fault_guard.h).
#pragma once

#include <atomic>
#include <boost/interprocess/mapped_region.hpp>
#include <cstddef>
#include <string>

#include "shm/fault_guard.h"

namespace mpf {

class Mapping {
 public:
  // copyOnWrite: this process may write, to copies of the pages that no other process sees. Reading
  // needs a descriptor that may only read.
  enum class Access { readOnly, readWrite, copyOnWrite };

  Mapping() noexcept = default;
  // Maps the first `bytes` of `file`, which may be closed afterwards.
  //   throws  std::system_error
  Mapping(int file, std::size_t bytes, Access access);
  ~Mapping() { unguard(); }
  Mapping(Mapping&& other) noexcept;
  Mapping& operator=(Mapping&& other) noexcept;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  [[nodiscard]] std::byte* data() const noexcept {
    return static_cast<std::byte*>(region_.get_address());
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return region_.get_size(); }
  [[nodiscard]] bool isLost() const noexcept {
    return lost_ != nullptr && lost_->load(std::memory_order_relaxed);
  }

  // See fault_guard.h.
  void growBy(int file) noexcept { fault_guard::growBy(*range_, file); }
  void growAt(int file, const std::string& path) noexcept {
    fault_guard::growAt(*range_, file, path);
  }

 private:
  void unguard() noexcept;
  boost::interprocess::mapped_region region_;
  fault_guard::Range* range_ = nullptr;
  const std::atomic<bool>* lost_ = nullptr;  // of range_
};

}  // namespace mpf
