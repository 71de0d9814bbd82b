// SPDX-License-Identifier: MIT
// Ip330Model: an Acromag IP330 that is not there: registers, timer, converter with its errors, mailboxes, interrupts.
//
//   Ip330Model model({.range = Ip330Range::minus5to5, .gainError = {0.01}, .noise = 0.4, .isRealTime = false});
//   model.setSignal(0, sineSignal(5, 2));
//   model.step();                            // one period of the timer
//
// In real time a thread of the model lets the timer run; otherwise step() does. Single scans and calibration take no time at all.
// After a change of the input source the first set of codes is off, as the converter settles.
// A real board takes its interrupt request back in the carrier's acknowledge cycle, which a model does not see: this one does when the mailbox
// of the last channel is read, or interrupts are disabled.
//
// Threads  any.
// Source   IP330 manual; what differential inputs do to the mailboxes is from the old driver.
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
#include <mpf/drivers/ip330/ip330_settings.h>
#include <mpf/drivers/ip330/ip330_signals.h>

namespace mpf {

struct Ip330ModelOptions {
  Ip330Range range = Ip330Range::minus5to5;  // its DIP switches
  std::array<double, kIp330Gains> gainError{};  // of each gain; 0.01: one percent too much
  std::array<double, kIp330Gains> offsetError{};  // codes
  double noise = 0;  // standard deviation, codes
  std::uint64_t seed = 1;
  bool isRealTime = true;
};

class Ip330Model final : public DeviceModel {
 public:
  explicit Ip330Model(const Ip330ModelOptions& options = {});
  ~Ip330Model() override;

  // What is on an input, at first 0 V. In differential mode channel n is the pair n.
  void setSignal(int channel, Ip330Signal signal);
  // Lets the timer pass `scans` periods, when this model has no time of its own.
  void step(int scans = 1);
  // A pulse at the external trigger's pin.
  void externalTrigger();
  // From now on no conversion ends, calibration included.
  void setStuck(bool isStuck);
  // When scans are disabled next, one has begun: it ends a little later, with the gains of then.
  void beginScanBeforeDisable();
  // Whether that one is still to end.
  [[nodiscard]] bool isEndingScan();
  // All registers as after power-up.
  void powerCycle();
  // What the code of a perfect converter would be: of 0 to 65536, not rounded.
  [[nodiscard]] static double idealCode(Ip330Range range, int gain, double volts) noexcept;

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

 private:
  static constexpr std::size_t kWords = 64;
  using Lock = std::lock_guard<std::mutex>;

  // All below: locked.
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
  bool leavesScan_ = false;  // beginScanBeforeDisable()
  std::vector<std::pair<std::size_t, std::uint16_t>> left_;  // mailboxes and codes of that scan
  std::int64_t leftUntilNs_ = 0;
  unsigned starts_ = 0;
  int half_ = 0;  // differential: which half of the mailboxes comes next
  int triggered_ = -1;  // converted last by an external trigger
  double seconds_ = 0;  // now
  double next_ = 0;  // when the next scan is due, in real time
  std::int64_t bornNs_;
  std::condition_variable_any changed_;
  std::jthread thread_;  // last
};

}  // namespace mpf
