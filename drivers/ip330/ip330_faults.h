// SPDX-License-Identifier: MIT
// Ip330Faults: what is wrong with a board now, and a hook for each time that something begins or ends to be.
//
// Threads  any; the hook runs on the thread that noticed, without any lock of the driver.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace mpf {

enum class Ip330Fault : std::uint8_t {
  absent,          // all bits read as ones, or another module is there
  silent,          // no scan ends
  interruptsLost,  // scans end, and no interrupt says so: found by looking
  storm,           // interrupts for which the board has nothing
  notCalibrated,   // conversion of a calibration voltage does not end, gives nonsense, or the end of the range
};

class Ip330Faults {
 public:
  //   text     a sentence for people
  //   isThere  false: it is over
  using Hook = std::function<void(const std::string& text, bool isThere)>;

  explicit Ip330Faults(Hook hook) : hook_(std::move(hook)) {}

  void set(Ip330Fault fault, bool isThere);
  [[nodiscard]] bool has(Ip330Fault fault) const noexcept {
    return isThere_[static_cast<std::size_t>(fault)].load(std::memory_order_relaxed);
  }
  // Empty, or the worst of them in a sentence.
  [[nodiscard]] std::string describe() const;

 private:
  Hook hook_;
  std::array<std::atomic<bool>, 5> isThere_{};
};

}  // namespace mpf
