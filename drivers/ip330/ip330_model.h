// SPDX-License-Identifier: MIT
// Ip330Model: device model of an Acromag IP330: registers, timer, converter with errors, mailboxes,
// interrupts.
//
//   Ip330Model model({.range = Ip330Range::minus5to5, .noise = 0.4, .isRealTime = false});
//   model.setSignal(0, sineSignal(5, 2));
//   model.step();                                            // one period of the timer
//
// In real time a thread of the model runs the timer; otherwise step() does. Single scans and
// calibration take no time. After a change of the input source the first conversion has wrong
// codes, since the converter settles. A real board ends its interrupt request in the acknowledge
// cycle of the carrier, which a model does not get; the model ends it when the mailbox of the last
// channel is read, or interrupts are disabled.
//
// Threads  any number of callers at a time.
// Source   IP330 manual; EPICS ip330 for the mailboxes of differential inputs.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <mpf/drivers/industry_pack/device_model.h>

#include "drivers/ip330/ip330_settings.h"
#include "drivers/ip330/ip330_signals.h"

namespace mpf {

struct Ip330ModelOptions {
  Ip330Range range = Ip330Range::minus5to5;  // as set by the DIP switches
  std::array<double, kIp330Gains> gainError{};  // by gain code; 0.01: codes are 1 % too high
  std::array<double, kIp330Gains> offsetError{};  // by gain code; in codes
  double noise = 0;  // standard deviation, codes
  std::uint64_t seed = 1;
  bool isRealTime = true;
};

class Ip330Model final : public DeviceModel {
 public:
  explicit Ip330Model(const Ip330ModelOptions& options = {});
  ~Ip330Model() override;

  // Sets the signal at an input; 0 V at first. In differential mode channel n is the pair n.
  void setSignal(int channel, Ip330Signal signal);
  // Runs `scans` periods of the timer; for a model that is not in real time.
  void step(int scans = 1);
  // Simulates a pulse at the pin of the external trigger.
  void externalTrigger();
  // Simulates a fault: no conversion ends, calibration included.
  void setStuck(bool isStuck);
  // Simulates a race: when scans are disabled next, a scan has begun, which ends a little later
  // with the gains of the time when scans were disabled.
  void beginScanBeforeDisable();
  // Returns whether the scan of beginScanBeforeDisable() has not ended yet.
  [[nodiscard]] bool isEndingScan();
  // Sets all registers to their values after power-up.
  void powerCycle();
  // The code of a perfect converter: 0 to 65536, not rounded.
  [[nodiscard]] static double idealCode(Ip330Range range, int gain, double volts) noexcept;

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

 private:
  static constexpr std::size_t kWords = 64;
  using Lock = std::lock_guard<std::mutex>;

  // The functions below are called with mutex_ held.
  [[nodiscard]] std::uint16_t control() const noexcept { return words_[0]; }
  [[nodiscard]] Ip330ScanMode scanMode() const noexcept;
  [[nodiscard]] int startChannel() const noexcept { return words_[3] & 0x1f; }
  [[nodiscard]] int endChannel() const noexcept { return (words_[3] >> 8) & 0x1f; }
  [[nodiscard]] int gainOf(int channel) const noexcept;
  [[nodiscard]] double periodSeconds() const noexcept;
  [[nodiscard]] double conversionSeconds() const noexcept;
  [[nodiscard]] double voltsAt(int channel, double seconds) const;
  [[nodiscard]] std::uint16_t codeOf(int channel, double seconds);
  void start();
  void scan();
  void convert(int channel, double seconds);
  void deliver(std::size_t mailbox, std::uint16_t code);
  [[nodiscard]] std::size_t mailboxOf(int channel) const noexcept;
  void endScan();
  void leaveScan();
  void finishScan();
  std::uint16_t readMailbox(std::size_t mailbox);
  void obeyControl(std::uint16_t before);
  void setFlag(std::size_t firstWord, std::size_t mailbox, bool isSet);
  [[nodiscard]] bool flag(std::size_t firstWord, std::size_t mailbox) const noexcept;
  [[nodiscard]] double clockSeconds() const noexcept;
  void run(const std::stop_token& stop);

  Ip330ModelOptions options_;
  std::mutex mutex_;
  std::array<std::uint16_t, kWords> words_{};  // the I/O space
  std::array<Ip330Signal, kIp330Channels> signals_;
  std::mt19937_64 random_;
  std::normal_distribution<double> noise_{0, 1};
  bool isRunning_ = false;  // continuous scans
  bool isStuck_ = false;
  bool isSettling_ = false;  // no scan has ended since the input source was changed
  bool leavesScan_ = false;  // beginScanBeforeDisable() was called
  std::vector<std::pair<std::size_t, std::uint16_t>> left_;  // mailboxes and codes of that scan
  std::int64_t leftUntilNs_ = 0;
  unsigned starts_ = 0;
  int half_ = 0;  // differential: the half of the mailboxes for the next scan
  int triggered_ = -1;  // the last channel that an external trigger converted
  double seconds_ = 0;  // time of the signals
  double next_ = 0;  // time of the next scan, in real time
  std::int64_t bornNs_;
  std::condition_variable_any changed_;
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
