// SPDX-License-Identifier: MIT
// LineCollector: a byte handler like that of a server: a read ends at an end-of-message string.
// Also the watchdog of waits.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <mpf/drivers/serial/serial_port.h>

#include "tests/support/watchdog.h"

namespace mpf::test {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

// Not an upper time limit of an operation: it only ends a test that hangs.
constexpr auto kWatchdog = Watchdog::kPatience;

inline Deadline watchdog() { return Deadline::after(kWatchdog); }

inline std::span<const std::uint8_t> bytesOf(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// A call of lineFailed().
struct ReportedFault {
  std::size_t at = 0;  // bytes received before it
  LineFault fault = LineFault::none;
  std::uint64_t count = 0;
  friend bool operator==(const ReportedFault&, const ReportedFault&) = default;
};

class LineCollector : public ByteHandler {
 public:
  explicit LineCollector(std::string end = "\r\n", std::string error = {})
      : end_(std::move(end)), error_(std::move(error)) {}

  ByteHandlerResult byteReceived(std::uint8_t byte) override {
    const std::lock_guard lock(mutex_);
    all_ += static_cast<char>(byte);
    changed_.notify_all();
    if (!error_.empty() && all_.ends_with(error_)) return ByteHandlerResult::error;
    return all_.ends_with(end_) ? ByteHandlerResult::endRead : ByteHandlerResult::ok;
  }
  ByteHandlerResult readBegins() override {
    const std::lock_guard lock(mutex_);
    start_ = all_.size();
    ++readsBegun_;
    changed_.notify_all();
    return acceptsEarlier_ && all_.ends_with(end_) ? ByteHandlerResult::endRead
                                                   : ByteHandlerResult::ok;
  }
  void readEnds(SerialPortStatus status) override {
    const std::lock_guard lock(mutex_);
    answer_ = all_.substr(start_);
    ends_.push_back(status);
  }

  void lineFailed(LineFault fault, std::uint64_t count) override {
    const std::lock_guard lock(mutex_);
    faults_.push_back({all_.size(), fault, count});
  }

  void clear() {
    const std::lock_guard lock(mutex_);
    all_.clear();
    start_ = 0;
  }
  // Circular buffer mode: a message that arrived before the read satisfies it.
  void acceptEarlier() { acceptsEarlier_ = true; }
  // The bytes of the last read.
  [[nodiscard]] std::string answer() const { return copyOf(answer_); }
  [[nodiscard]] std::string all() const { return copyOf(all_); }
  [[nodiscard]] std::vector<SerialPortStatus> ends() const { return copyOf(ends_); }
  [[nodiscard]] std::vector<ReportedFault> faults() const { return copyOf(faults_); }
  [[nodiscard]] int readsBegun() const { return copyOf(readsBegun_); }
  [[nodiscard]] bool waitForAll(std::string_view text) const {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kWatchdog, [&] { return all_ == text; });
  }
  [[nodiscard]] bool waitForRead() const {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kWatchdog, [&] { return readsBegun_ > 0; });
  }

 private:
  template <class T>
  T copyOf(const T& member) const {
    const std::lock_guard lock(mutex_);
    return member;
  }
  const std::string end_;
  const std::string error_;
  bool acceptsEarlier_ = false;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::string all_;
  std::string answer_;
  std::size_t start_ = 0;
  int readsBegun_ = 0;
  std::vector<SerialPortStatus> ends_;
  std::vector<ReportedFault> faults_;
};

}  // namespace mpf::test
