// SPDX-License-Identifier: MIT
// RequestLog: counts how often servers have received each request of a test, in a file that they
// share. The counts stay when the servers are killed.
//
// Threads  any number of processes count; the test reads.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class RequestLog {
 public:
  static constexpr std::uint32_t kRequests = 1u << 20;
  // cmd of a request that must be counted; its number is its `value`
  static constexpr std::int32_t kCounted = 4711;

  // Creates the file if it does not exist.
  explicit RequestLog(const std::string& file) {
    const FileDescriptor log(
        checkCall(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600), "open", file));
    checkCall(::ftruncate(log.get(), kBytes), "ftruncate", file);
    auto* const memory = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, log.get(), 0);
    if (memory == MAP_FAILED) throwSystemError(errno, "mmap", file);
    counts_ = static_cast<std::atomic<std::uint8_t>*>(memory);
  }
  ~RequestLog() { ::munmap(counts_, kBytes); }
  RequestLog(const RequestLog&) = delete;
  RequestLog& operator=(const RequestLog&) = delete;

  // Counts wrap at kRequests.
  void note(std::int32_t number) noexcept { ++at(number); }
  [[nodiscard]] int timesSeen(std::int32_t number) const noexcept { return at(number); }

 private:
  static constexpr std::size_t kBytes = kRequests;
  [[nodiscard]] std::atomic<std::uint8_t>& at(std::int32_t number) const noexcept {
    return counts_[static_cast<std::uint32_t>(number) % kRequests];
  }
  std::atomic<std::uint8_t>* counts_ = nullptr;
};

}  // namespace mpf::test
