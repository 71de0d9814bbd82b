// SPDX-License-Identifier: MIT
// Ip330Chip: the register sequences of one board: start scans, take their results, measure a
// calibration voltage.
//
// With differential inputs the results of successive scans alternate between mailboxes 0-15 and
// 16-31. The object remembers which half is next and checks its new-data flags, so a scan that was
// not taken in time does not swap the halves.
//
// Threads  one at a time: the owner holds a lock.
// Source   IP330 manual. EPICS ip330 R1-4 read only the lower half, and when calibrating waited
//          only for flags of the upper half.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include <mpf/drivers/industry_pack/registers.h>

#include "drivers/ip330/ip330_settings.h"

namespace mpf {

class Ip330Chip {
 public:
  enum class Presence : std::uint8_t { asProgrammed, reset, absent };
  using Codes = std::array<std::uint16_t, kIp330Channels>;
  // The scans that were ready, the older one first.
  struct Scans {
    std::array<Codes, 2> codes{};  // index: channel
    std::size_t count = 0;
    bool isMissing = false;  // an earlier scan was overwritten
    bool isSettled = true;  // false: the converter had not settled, so the codes are invalid
  };

  explicit Ip330Chip(Registers& io) : io_(io) {}

  // Writes all registers, interrupt control last, and starts continuous scans. After a change of
  // the input source one conversion of all channels is discarded first.
  //   settings  must be valid: problem() is empty
  //   limit     longest wait for that conversion
  void start(const Ip330Settings& settings, const std::array<std::uint8_t, kIp330Channels>& gains,
             std::chrono::nanoseconds limit);
  // Stops scans and interrupts, and discards all results. Waits for the end of a burst that has
  // begun, since its codes have the previous gains.
  void stop();
  // Sends a software trigger, for the single modes.
  void startConvert();

  // Compares registers with what start() wrote.
  [[nodiscard]] Presence presence();
  // Takes the scans that are ready; the reads end the interrupt request of the board.
  void take(const Ip330Settings& settings, Scans& scans);
  // Measures a calibration voltage; call stop() first. The first conversion is discarded, since the
  // converter settles.
  //   source   calibration voltage, bits of the control register
  //   limit    longest wait for each of the two conversions
  //   returns  the mean code of all channels; nullopt when a conversion does not end
  [[nodiscard]] std::optional<double> tryMeasure(std::uint16_t source, int gain,
                                                 std::chrono::nanoseconds limit);

 private:
  void writeControl(std::uint16_t control);
  [[nodiscard]] bool takeHalf(const Ip330Settings& settings, int half, Scans& scans);
  void settle(const Ip330Settings& settings, std::chrono::nanoseconds limit);
  void prepareSingle(std::uint16_t source, int channels);
  [[nodiscard]] bool tryConvert(int channels, std::chrono::nanoseconds limit);
  [[nodiscard]] std::uint32_t readAllMailboxes();

  Registers& io_;
  std::uint16_t control_ = 0;  // last value written to the register
  int half_ = 0;  // differential: the half of the next scan
  bool isSettled_ = true;  // false: the next scan is invalid
  int converting_ = 0;  // number of channels of a scan that may have begun
};

}  // namespace mpf
