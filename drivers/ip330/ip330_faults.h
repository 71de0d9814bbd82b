// SPDX-License-Identifier: MIT
// Ip330Faults: the current faults of a board; calls a hook when a fault begins or ends.
//
// Threads  any number of callers at a time. The hook runs on the thread that noticed the change,
//          with no lock of the driver held.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace mpf {

enum class Ip330Fault : std::uint8_t {
  absent,          // all bits read as ones, or another module is in its place
  silent,          // no scan ends
  interruptsLost,  // scans end without an interrupt; they are found by polling
  storm,           // interrupts without a scan
  // a calibration voltage gives no codes, implausible codes, or the end of the range
  notCalibrated,
};

class Ip330Faults {
 public:
  //   text     a sentence about the fault, or about its end
  //   isThere  true when the fault begins, false when it ends
  using Hook = std::function<void(const std::string& text, bool isThere)>;

  explicit Ip330Faults(Hook hook) : hook_(std::move(hook)) {}

  void set(Ip330Fault fault, bool isThere);
  [[nodiscard]] bool has(Ip330Fault fault) const noexcept {
    return isThere_[static_cast<std::size_t>(fault)].load(std::memory_order_relaxed);
  }
  // Returns a sentence about the worst fault; empty without a fault.
  [[nodiscard]] std::string describe() const;

 private:
  Hook hook_;
  std::array<std::atomic<bool>, 5> isThere_{};
};

}  // namespace mpf
