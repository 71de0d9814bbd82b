// SPDX-License-Identifier: MIT
// Ip330: driver of the Acromag IP330; scans the inputs and calibrates the converter (manual,
// "ip330Scan").
//
//   interrupt ─► interrupt thread ─► mailboxes ─► corrected codes ─► every subscriber, scan by scan
//   keeper thread: calibrates periodically; checks that the board is present, scans and has its
//                  settings
//
//   Ip330 board(module, {.type = parseIp330Type("D"), .lastChannel = 15});
//   const auto subscription =
//       board.subscribe([&](const Ip330Sample& sample) { use(sample.corrected[3]); });
//
// A calibration is stored for each gain, so a change to a gain that was calibrated before needs no
// measurement. Calibration holds the lock that the interrupt thread needs, and the interrupts of
// the board are off meanwhile: scans and calibration never read each other's mailboxes.
//
// Threads  any number of callers at a time. Subscribers are called by the interrupt thread, one at
//          a time.
// Crash    the board continues to scan, unread, until the carrier is opened again.
// Trust    a broken board may return any codes; they are used as numbers, never as an index.
// Source   IP330 manual; EPICS ip330 R1-7 for what clients expect, without its races and its silent
//          clamping.
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

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>

#include "drivers/ip330/ip330_calibration.h"
#include "drivers/ip330/ip330_chip.h"
#include "drivers/ip330/ip330_faults.h"
#include "drivers/ip330/ip330_settings.h"

namespace mpf {

inline const ModuleKind kIp330{.name = "Acromag IP330", .manufacturer = kAcromag, .models = {0x11}};

// The result of one scan. The arrays are indexed by channel.
struct Ip330Sample {
  // codes, neither rounded nor clamped, for means; see clampedCode()
  std::array<double, kIp330Channels> corrected{};
  Ip330Chip::Codes raw{};  // codes of the converter
  std::array<std::uint8_t, kIp330Channels> gain{};  // codes 0 to 3
  std::uint32_t valid = 0;  // bit n: channel n is scanned, and calibrated if calibration is on
  std::uint64_t epoch = 0;  // Ip330::epoch() at the time of the scan

  [[nodiscard]] bool isValid(int channel) const noexcept { return (valid >> channel & 1) != 0; }
};

// Times and limits of the driver; tests use others.
struct Ip330Limits {
  // longest conversion of all channels; the chip needs 0.5 ms
  std::chrono::milliseconds conversion{100};
  // longest time without a scan, plus ten periods; also the delay before a retry
  std::chrono::milliseconds silence{2000};
  std::chrono::milliseconds lookEvery{100};  // period of the keeper thread
  std::chrono::milliseconds pollEvery{10};  // finds scans whose interrupt was lost
  int stormLimit = 16;  // see InterruptThreadOptions
  std::chrono::milliseconds stormPause{1000};
};

class Ip330 {
 public:
  using Subscriber = std::function<void(const Ip330Sample&)>;

  // Programs and calibrates the board, and starts to scan. A failed calibration is a fault, not an
  // error.
  //
  //   module  must outlive this object
  //   hook    called when a fault begins or ends, see Ip330Faults
  //   throws  std::invalid_argument with settings.problem(); std::system_error when a thread cannot
  //           be started
  Ip330(IndustryPackModule& module, const Ip330Settings& settings, Ip330Faults::Hook hook = {},
        const Ip330Limits& limits = {});
  // Stops scans and interrupts of the board, if it is present. All subscriptions must have ended.
  ~Ip330();
  Ip330(const Ip330&) = delete;
  Ip330& operator=(const Ip330&) = delete;

  [[nodiscard]] Ip330Settings settings() const;
  [[nodiscard]] int gain(int channel) const;
  // The period of the scans [us] that the timer registers give; 0 when it depends on triggers.
  [[nodiscard]] double microsecondsPerScan() const noexcept {
    return microsecondsPerScan_.load(std::memory_order_relaxed);
  }
  // Changes when earlier samples are no longer comparable: after a change of scan mode or time, or
  // after the board was absent or silent.
  [[nodiscard]] std::uint64_t epoch() const noexcept {
    return epoch_.load(std::memory_order_relaxed);
  }
  // The longest time without a scan in normal operation.
  [[nodiscard]] std::chrono::nanoseconds patience() const noexcept;
  // Returns false while the board is absent or silent.
  [[nodiscard]] bool isDelivering() const noexcept {
    return !faults_.has(Ip330Fault::absent) && !faults_.has(Ip330Fault::silent);
  }
  // Returns a sentence about the worst fault; empty without a fault.
  [[nodiscard]] std::string problem() const { return faults_.describe(); }

  // Sets the gain of a channel; later samples have this gain. A gain that could not be calibrated
  // is tried again after Ip330Limits::silence, or after a successful tryCalibrate().
  //
  //   gain     code 0 to 3, see kIp330Gain
  //   returns  false when the channel or gain does not exist, the gain cannot be calibrated, or the
  //            board is absent; the channel then keeps its gain
  [[nodiscard]] bool trySetGain(int channel, int gain);
  // Changes the scan mode.
  //   returns  a sentence that says why the change is impossible, with nothing changed; empty on
  //            success
  [[nodiscard]] std::string tryConfigure(Ip330ScanMode mode, Ip330Trigger trigger,
                                         double microsecondsPerScan);
  // Sets the period of calibration and calibrates now, unless `seconds` is negative. Returns false
  // when this calibration failed.
  bool trySetSecondsBetweenCalibrate(int seconds);
  // Calibrates all gains in use. Returns false when the board is absent, or a gain could not be
  // calibrated because its codes were invalid or missing; such a gain keeps its previous
  // correction.
  bool tryCalibrate();
  // Starts a scan in a single mode. Returns false in other modes and when the board is absent.
  [[nodiscard]] bool tryStartConvert();

  struct Counters {
    std::uint64_t scans = 0;
    std::uint64_t missed = 0;  // how often scans were overwritten before they were read
    std::uint64_t calibrations = 0;
    InterruptThread::Counters interrupts;
  };
  [[nodiscard]] Counters counters() const noexcept;

  // Ends the subscription when it is destroyed: the subscriber is not running then and does not run
  // again.
  using Subscription = std::shared_ptr<void>;
  // Calls `subscriber` for each scan from now on. It must not subscribe, end a subscription, or
  // wait for a thread that does. This object must outlive the subscription.
  //   throws  std::length_error when settings.maxClients subscriptions exist already
  [[nodiscard]] Subscription subscribe(Subscriber subscriber);

 private:
  using Lock = std::lock_guard<std::mutex>;
  using Gains = std::array<bool, kIp330Gains>;

  // Called with mutex_ held.
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
  std::list<Subscriber>::iterator add(Subscriber subscriber);
  void keep(const std::stop_token& stop);
  void look();
  void lookForBoard();
  void lookForScans();
  void calibrateWhenDue();

  IndustryPackModule& module_;
  const Ip330Limits limits_;
  Ip330Faults faults_;

  mutable std::mutex mutex_;  // guards the board and the members below
  Ip330Settings settings_;
  Ip330Chip chip_;
  std::array<std::uint8_t, kIp330Channels> gains_{};
  std::array<std::optional<Ip330Correction>, kIp330Gains> corrections_;
  std::array<Deadline, kIp330Gains> refusedUntil_;
  Deadline calibrateAt_ = Deadline::never();
  std::int64_t startNs_ = 0;

  std::atomic<double> microsecondsPerScan_{0};
  std::atomic<std::uint64_t> epoch_{0};
  // or the begin of an epoch; not of each start, since a failed calibration also starts
  std::atomic<std::int64_t> lastScanNs_{0};
  std::atomic<std::uint64_t> scans_{0}, missed_{0}, calibrations_{0};
  std::atomic<int> lateInRow_{0};  // scans found by polling since the last interrupt

  std::mutex subscribersMutex_;
  std::list<Subscriber> subscribers_;

  std::uint64_t scansSeen_ = 0;  // used by the keeper thread
  std::mutex keeperMutex_;
  std::condition_variable_any keeperWakes_;
  std::unique_ptr<InterruptThread> interruptThread_;
  std::jthread keeper_;  // last: ends before the members that it uses
};

}  // namespace mpf
