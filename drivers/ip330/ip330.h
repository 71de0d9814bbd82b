// SPDX-License-Identifier: MIT
// Ip330: an Acromag IP330 that scans its inputs and calibrates itself (manual, "ip330Scan").
//
//   interrupt ─► interrupt thread ─► mailboxes ─► corrected codes ─► every subscriber, scan by scan
//   keeper thread: calibrates every so often; looks whether the board is there, scans, and is as it was programmed
//
//   Ip330 board(module, {.type = parseIp330Type("D"), .lastChannel = 15});
//   const auto subscription = board.subscribe([&](const Ip330Sample& sample) { ...sample.corrected[3]... });
//
// Calibration is kept by gain: a change to a gain that was calibrated before costs no measurement. It holds the lock that the interrupt thread
// needs, with the board's interrupts off: neither sees the other's mailboxes.
//
// Threads  any. Subscribers are called by the interrupt thread, one at a time.
// Crash    the board goes on scanning until the carrier is opened again; nobody reads it.
// Trust    codes of a board that is broken may be anything; they are numbers and never an index.
// Source   IP330 manual; ip330 R1-7 for what clients expect, its races and silent clamping aside.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <mpf/base/clock.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>
#include <mpf/drivers/ip330/ip330_calibration.h>
#include <mpf/drivers/ip330/ip330_chip.h>
#include <mpf/drivers/ip330/ip330_faults.h>
#include <mpf/drivers/ip330/ip330_settings.h>

namespace mpf {

inline const ModuleKind kIp330{.name = "Acromag IP330", .manufacturer = kAcromag, .models = {0x11}};

// What one scan gave; index: channel.
struct Ip330Sample {
  std::array<double, kIp330Channels> corrected{};  // codes, neither rounded nor clamped: for means. clampedCode() makes a value of it
  Ip330Chip::Codes raw{};
  std::array<std::uint8_t, kIp330Channels> gain{};
  std::uint32_t valid = 0;  // bit n: channel n is scanned, and calibrated unless calibration is off
  std::uint64_t epoch = 0;  // Ip330::epoch() when it was taken

  [[nodiscard]] bool isValid(int channel) const noexcept { return (valid >> channel & 1) != 0; }
};

// How long what may take; for tests to change.
struct Ip330Limits {
  std::chrono::milliseconds conversion{100};  // of all channels: the chip needs half a millisecond
  std::chrono::milliseconds silence{2000};  // without a scan, beside ten periods of it; and until what failed is tried again
  std::chrono::milliseconds lookEvery{100};  // the keeper
  std::chrono::milliseconds pollEvery{10};  // for scans whose interrupt did not come
  int stormLimit = 16;
  std::chrono::milliseconds stormPause{1000};
};

class Ip330 {
 public:
  using Subscriber = std::function<void(const Ip330Sample&)>;

  // Programs and calibrates the board, and starts to scan. A board that cannot be calibrated is a fault, not an error.
  //   module  must outlive this
  //   throws  std::invalid_argument with settings.problem()
  Ip330(IndustryPackModule& module, const Ip330Settings& settings, Ip330Faults::Hook hook = {}, const Ip330Limits& limits = {});
  // The board's interrupts are off and it does not scan, if it is there. No subscription is left.
  ~Ip330();
  Ip330(const Ip330&) = delete;
  Ip330& operator=(const Ip330&) = delete;

  [[nodiscard]] Ip330Settings settings() const;
  [[nodiscard]] int gain(int channel) const;
  // What the timer makes of the time asked for; 0 when only triggers know.
  [[nodiscard]] double microsecondsPerScan() const noexcept { return microsecondsPerScan_.load(std::memory_order_relaxed); }
  // Changes when earlier samples mean nothing any more: another scan mode or time, a board that was gone or silent.
  [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_.load(std::memory_order_relaxed); }
  // Without a scan for that long something is wrong.
  [[nodiscard]] std::chrono::nanoseconds patience() const noexcept;
  // Whether scans come: false when the board is gone, or silent.
  [[nodiscard]] bool isDelivering() const noexcept { return !faults_.has(Ip330Fault::absent) && !faults_.has(Ip330Fault::silent); }
  // Empty, or what is wrong, in a sentence.
  [[nodiscard]] std::string problem() const { return faults_.describe(); }

  // False: there is no such channel or gain, this gain cannot be calibrated, or the board is gone; then the channel keeps the gain that it has.
  // A gain that could not be calibrated is tried again after Ip330Limits::silence, or when calibration has succeeded. Samples after it have
  // that gain.
  [[nodiscard]] bool trySetGain(int channel, int gain);
  // Empty, or why not; then all is as it was.
  [[nodiscard]] std::string tryConfigure(Ip330ScanMode mode, Ip330Trigger trigger, double microsecondsPerScan);
  // Also calibrates now, unless it is negative. False: that failed.
  bool trySetSecondsBetweenCalibrate(int seconds);
  // All gains in use. False: one of them gave nonsense or nothing, and keeps the correction that it had; or the board is gone.
  bool tryCalibrate();
  // A scan, in the single modes. False: another mode, or the board is gone.
  [[nodiscard]] bool tryStartConvert();

  struct Counters {
    std::uint64_t scans = 0;
    std::uint64_t missed = 0;  // times that scans were overwritten before they were read
    std::uint64_t calibrations = 0;
    InterruptThread::Counters interrupts;
  };
  [[nodiscard]] Counters counters() const noexcept;

  // Ends a subscription when it is destroyed: then its subscriber is not running, and does not run any more.
  using Subscription = std::shared_ptr<void>;
  // The subscriber must not subscribe, end subscriptions, or wait for who does.
  //   throws  std::length_error when there are settings.maxClients already
  [[nodiscard]] Subscription subscribe(Subscriber subscriber);

 private:
  using Lock = std::lock_guard<std::mutex>;
  using Gains = std::array<bool, kIp330Gains>;

  // Locked: mutex_.
  [[nodiscard]] bool isReady();
  void start();
  void begin();
  [[nodiscard]] bool calibrate(const Gains& gains);
  [[nodiscard]] std::optional<bool> calibrate(int gain);
  void calibrateSoon();
  [[nodiscard]] bool trySet(std::uint8_t& channelsGain, std::uint8_t gain);
  [[nodiscard]] Gains gainsInUse() const;
  [[nodiscard]] bool isCalibrated(int gain) const;
  void correct(const Ip330Chip::Codes& codes, Ip330Sample& sample) const;

  [[nodiscard]] bool serve(InterruptThread::Cause cause);
  void noteCause(InterruptThread::Cause cause);
  void deliver(const Ip330Sample& sample);
  void keep(const std::stop_token& stop);
  void look();
  void lookForBoard();
  void lookForScans();
  void lookForStorm();
  void calibrateWhenDue();

  IndustryPackModule& module_;
  const Ip330Limits limits_;
  Ip330Faults faults_;

  mutable std::mutex mutex_;  // this and below: the board
  Ip330Settings settings_;
  Ip330Chip chip_;
  std::array<std::uint8_t, kIp330Channels> gains_{};
  std::array<std::optional<Ip330Correction>, kIp330Gains> corrections_;
  std::array<Deadline, kIp330Gains> refusedUntil_;
  Deadline calibrateAt_ = Deadline::never();
  std::int64_t startNs_ = 0;

  std::atomic<double> microsecondsPerScan_{0};
  std::atomic<std::uint64_t> epoch_{0};
  std::atomic<std::int64_t> lastScanNs_{
      0};  // or the beginning of an epoch; not each start, of which there may be one for each failed calibration
  std::atomic<std::uint64_t> scans_{0}, missed_{0}, calibrations_{0};
  std::atomic<int> lateInRow_{0};  // scans found by looking, since the last interrupt

  std::mutex subscribersMutex_;
  std::list<Subscriber> subscribers_;

  std::uint64_t stormsSeen_ = 0;  // the keeper's, as those below
  std::uint64_t scansSeen_ = 0;
  Deadline stormOver_ = Deadline::never();
  std::mutex keeperMutex_;
  std::condition_variable_any keeperWakes_;
  std::unique_ptr<InterruptThread> interruptThread_;
  std::jthread keeper_;  // last
};

}  // namespace mpf
