// SPDX-License-Identifier: MIT
// Ip330Chip: the registers of one board, in steps: start a scan, take what it gave, measure a calibration voltage.
//
// Differential inputs: the results of successive scans alternate between mailboxes 0-15 and 16-31. Which half is next is remembered, and the
// new-data flags say whether it is there: a scan that nobody took in time does not turn the halves round.
//
// Threads  one at a time: the owner has a lock.
// Source   IP330 manual; the original read only the lower half in release 1-4, and waited for flags of the upper half alone when calibrating.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include <mpf/drivers/industry_pack/registers.h>
#include <mpf/drivers/ip330/ip330_settings.h>

namespace mpf {

class Ip330Chip {
 public:
  enum class Presence : std::uint8_t { asProgrammed, reset, absent };
  using Codes = std::array<std::uint16_t, kIp330Channels>;
  // Scans that were waiting, the older one first.
  struct Scans {
    std::array<Codes, 2> codes{};  // index: channel
    std::size_t count = 0;
    bool isMissing = false;  // one before them was overwritten
    bool isSettled = true;  // false: the converter had not settled, the codes are worth nothing
  };

  explicit Ip330Chip(Registers& io) : io_(io) {}

  // Writes all registers, interrupt control last, and starts continuous scans. After another input source a set of codes is thrown away first.
  //   settings  with no problem()
  //   limit     longest wait for that set
  void start(const Ip330Settings& settings, const std::array<std::uint8_t, kIp330Channels>& gains, std::chrono::nanoseconds limit);
  // No scan, no interrupt; forgets what was measured so far. Waits until a burst that had begun is over: its codes have the gains of before.
  void stop();
  // A software trigger, for the single modes.
  void startConvert();

  [[nodiscard]] Presence presence();
  // Takes what is there; reading makes the board take its request back.
  void take(const Ip330Settings& settings, Scans& scans);
  // The mean code of all channels on a calibration voltage, after start() to be stopped. The first set of codes is thrown away: the converter settles.
  //   limit    longest wait for each set
  //   returns  nullopt when conversion does not end
  [[nodiscard]] std::optional<double> tryMeasure(std::uint16_t source, int gain, std::chrono::nanoseconds limit);

 private:
  void writeControl(std::uint16_t control);
  [[nodiscard]] bool takeHalf(const Ip330Settings& settings, int half, Scans& scans);
  void settle(const Ip330Settings& settings, std::chrono::nanoseconds limit);
  void prepareSingle(std::uint16_t source, int channels);
  [[nodiscard]] bool tryConvert(int channels, std::chrono::nanoseconds limit);
  [[nodiscard]] std::uint32_t readAllMailboxes();

  Registers& io_;
  std::uint16_t control_ = 0;  // what is in the register
  int half_ = 0;  // differential: where the next scan is
  bool isSettled_ = true;  // false: the first scan is worth nothing
  int converting_ = 0;  // channels of which a scan may have begun
};

}  // namespace mpf
