// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "base/signals_blocked.h"
#include "drivers/ip330/ip330_timing.h"

namespace mpf {
namespace {

constexpr int kLateInRow = 3;

Ip330Settings checked(const Ip330Settings& settings) {
  if (const auto problem = settings.problem(); !problem.empty())
    throw std::invalid_argument(problem);
  return settings;
}

std::array<Deadline, kIp330Gains> notRefused() {
  const auto longAgo = Deadline::atNs(0);
  return {longAgo, longAgo, longAgo, longAgo};
}

}  // namespace

Ip330::Ip330(IndustryPackModule& module, const Ip330Settings& settings, Ip330Faults::Hook hook,
             const Ip330Limits& limits)
    : module_(module),
      limits_(limits),
      faults_(std::move(hook)),
      settings_(checked(settings)),
      chip_(module.io()),
      refusedUntil_(notRefused()) {
  {
    const Lock lock(mutex_);
    begin();
  }
  trySetSecondsBetweenCalibrate(settings_.secondsBetweenCalibrate);
  const InterruptThreadOptions options{.pollEvery = limits_.pollEvery,
                                       .stormLimit = limits_.stormLimit,
                                       .stormPause = limits_.stormPause};
  interruptThread_ = std::make_unique<InterruptThread>(
      module_.interrupt(0), options, [this](InterruptThread::Cause cause) { return serve(cause); });
  const SignalsBlocked blocked;
  keeper_ = std::jthread([this](const std::stop_token& stop) { keep(stop); });
}

Ip330::~Ip330() {
  keeper_ = {};
  interruptThread_.reset();
  const Lock lock(mutex_);
  if (isReady()) chip_.stop();
}

Ip330Settings Ip330::settings() const {
  const Lock lock(mutex_);
  return settings_;
}

int Ip330::gain(int channel) const {
  const Lock lock(mutex_);
  return gains_.at(static_cast<std::size_t>(channel));
}

Ip330::Counters Ip330::counters() const noexcept {
  return {.scans = scans_.load(std::memory_order_relaxed),
          .missed = missed_.load(std::memory_order_relaxed),
          .calibrations = calibrations_.load(std::memory_order_relaxed),
          .interrupts = interruptThread_->counters()};
}

std::chrono::nanoseconds Ip330::patience() const noexcept {
  return limits_.silence +
         std::chrono::nanoseconds(static_cast<std::int64_t>(10'000 * microsecondsPerScan()));
}

// ---- the board

// Returns whether the board is present and programmed. A board that has lost its settings may have
// been replaced, even by another module, so nothing is written until the keeper has checked it.
bool Ip330::isReady() {
  return !faults_.has(Ip330Fault::absent) && chip_.presence() == Ip330Chip::Presence::asProgrammed;
}

void Ip330::start() {
  microsecondsPerScan_.store(
      ip330TimerOf(settings_.scanMode, settings_.channels(), settings_.microsecondsPerScan)
          .microsecondsPerScan,
      std::memory_order_relaxed);
  chip_.start(settings_, gains_, limits_.conversion);
  startNs_ = Clock::nowNs();
}

// Starts a new epoch: earlier samples are not comparable with those that follow.
void Ip330::begin() {
  epoch_.fetch_add(1, std::memory_order_relaxed);
  start();
  lastScanNs_.store(startNs_, std::memory_order_relaxed);
}

bool Ip330::trySetGain(int channel, int gain) {
  const auto wanted = static_cast<std::uint8_t>(gain);
  bool isGood = true;
  {
    const Lock lock(mutex_);
    if (gain < 0 || gain >= kIp330Gains || !settings_.has(channel)) return false;
    auto& set = gains_[static_cast<std::size_t>(channel)];
    if (set == wanted && isCalibrated(gain)) return true;
    if (!isReady() || !refusedUntil_[wanted].hasPassed()) return false;
    isGood = trySet(set, wanted);
  }
  if (!isGood) faults_.set(Ip330Fault::notCalibrated, true);
  return isGood;
}

bool Ip330::trySet(std::uint8_t& channelsGain, std::uint8_t gain) {
  const auto before = std::exchange(channelsGain, gain);
  if (isCalibrated(gain)) return start(), true;
  Gains gains{};
  gains[gain] = true;
  if (calibrate(gains)) return true;
  // repeated requests for this gain must not stop the scans of other clients
  refusedUntil_[gain] = Deadline::after(limits_.silence);
  channelsGain = before;
  start();
  return false;
}

std::string Ip330::tryConfigure(Ip330ScanMode mode, Ip330Trigger trigger,
                                double microsecondsPerScan) {
  const Lock lock(mutex_);
  auto wanted = settings_;
  wanted.scanMode = mode;
  wanted.trigger = trigger;
  wanted.microsecondsPerScan = microsecondsPerScan;
  if (auto problem = wanted.problem(); !problem.empty()) return problem;
  if (!isReady()) return "the board is absent or not programmed yet";
  settings_ = wanted;
  begin();
  return {};
}

bool Ip330::trySetSecondsBetweenCalibrate(int seconds) {
  {
    const Lock lock(mutex_);
    settings_.secondsBetweenCalibrate = seconds;
    calibrateAt_ = Deadline::never();
  }
  if (seconds < 0) {
    faults_.set(Ip330Fault::notCalibrated, false);
    return true;
  }
  return tryCalibrate();
}

bool Ip330::tryCalibrate() {
  bool isGood = false;
  {
    const Lock lock(mutex_);
    isGood = calibrate(gainsInUse());
    const auto period = settings_.secondsBetweenCalibrate;
    // counted from the end of the calibration
    calibrateAt_ = period > 0 ? Deadline::after(std::chrono::seconds(period)) : Deadline::never();
    if (isGood) refusedUntil_ = notRefused();
    if (!isGood) calibrateSoon();
  }
  faults_.set(Ip330Fault::notCalibrated, !isGood);
  return isGood;
}

bool Ip330::calibrate(const Gains& gains) {
  if (!isReady()) return calibrateSoon(), false;
  bool isGood = true;
  bool ends = true;  // if one conversion does not end, the others are not tried
  chip_.stop();
  for (int gain = 0; gain < kIp330Gains && ends; ++gain) {
    if (!gains[static_cast<std::size_t>(gain)]) continue;
    const auto isSense = calibrate(gain);
    ends = isSense.has_value();
    isGood = isGood && isSense.value_or(false);
  }
  start();
  if (!ends) calibrateSoon();
  calibrations_.fetch_add(1, std::memory_order_relaxed);
  return isGood;
}

// Returns whether the codes are plausible; nullopt when a conversion does not end.
std::optional<bool> Ip330::calibrate(int gain) {
  const auto [low, high] = calibrationPointsOf(settings_.range, gain);
  const auto lowCode = chip_.tryMeasure(low.source, gain, limits_.conversion);
  const auto highCode =
      lowCode ? chip_.tryMeasure(high.source, gain, limits_.conversion) : std::nullopt;
  if (!highCode) return std::nullopt;
  const auto correction = correctionOf(settings_.range, gain, *lowCode, *highCode);
  if (correction) corrections_[static_cast<std::size_t>(gain)] = correction;
  return correction.has_value();
}

// Makes the keeper calibrate again after the delay of a retry, unless calibration is off: then no
// sample uses the result, and a retry would only stop the scans.
void Ip330::calibrateSoon() {
  if (settings_.secondsBetweenCalibrate < 0) return;
  calibrateAt_ = std::min(calibrateAt_, Deadline::after(limits_.silence));
}

Ip330::Gains Ip330::gainsInUse() const {
  Gains gains{};
  for (int channel = settings_.firstChannel; channel <= settings_.lastChannel; ++channel) {
    gains[gains_[static_cast<std::size_t>(channel)]] = true;
  }
  return gains;
}

bool Ip330::isCalibrated(int gain) const {
  return settings_.secondsBetweenCalibrate < 0 ||
         corrections_[static_cast<std::size_t>(gain)].has_value();
}

bool Ip330::tryStartConvert() {
  const Lock lock(mutex_);
  if (!isSingle(settings_.scanMode) || !isReady()) return false;
  chip_.startConvert();
  return true;
}

// ---- scans

bool Ip330::serve(InterruptThread::Cause cause) {
  std::array<Ip330Sample, 2> samples;
  Ip330Chip::Scans scans;
  {
    const Lock lock(mutex_);
    if (!isReady()) return false;  // the keeper handles this
    chip_.take(settings_, scans);
    for (std::size_t i = 0; i < scans.count && scans.isSettled; ++i)
      correct(scans.codes[i], samples[i]);
  }
  if (scans.count == 0) return false;
  noteCause(cause);
  lastScanNs_.store(Clock::nowNs(), std::memory_order_relaxed);
  if (scans.isMissing) missed_.fetch_add(1, std::memory_order_relaxed);
  for (std::size_t i = 0; i < scans.count; ++i) deliver(samples[i]);
  return true;
}

void Ip330::noteCause(InterruptThread::Cause cause) {
  if (cause == InterruptThread::Cause::interrupt) {
    lateInRow_.store(0, std::memory_order_relaxed);
  } else {
    lateInRow_.fetch_add(1, std::memory_order_relaxed);
  }
}

void Ip330::correct(const Ip330Chip::Codes& codes, Ip330Sample& sample) const {
  sample.raw = codes;
  sample.gain = gains_;
  sample.epoch = epoch();
  sample.valid = 0;
  for (auto i = static_cast<std::size_t>(settings_.firstChannel);
       i <= static_cast<std::size_t>(settings_.lastChannel); ++i) {
    const auto& correction = corrections_[gains_[i]];
    if (settings_.secondsBetweenCalibrate < 0) {
      sample.corrected[i] = codes[i];
    } else if (correction) {
      sample.corrected[i] = correction->apply(codes[i]);
    } else {
      continue;
    }
    sample.valid |= 1U << i;
  }
}

void Ip330::deliver(const Ip330Sample& sample) {
  const Lock lock(subscribersMutex_);
  for (const auto& subscriber : subscribers_) subscriber(sample);
  scans_.fetch_add(1, std::memory_order_relaxed);
}

Ip330::Subscription Ip330::subscribe(Subscriber subscriber) {
  const auto at = add(std::move(subscriber));
  // Without the lock: if there is no memory for the handle, it calls its deleter.
  return {nullptr, [this, at](void*) {
            const Lock lock(subscribersMutex_);
            subscribers_.erase(at);
          }};
}

std::list<Ip330::Subscriber>::iterator Ip330::add(Subscriber subscriber) {
  const auto most = static_cast<std::size_t>(settings().maxClients);
  const Lock lock(subscribersMutex_);
  if (subscribers_.size() >= most)
    throw std::length_error(fmt::format(
        "{} already has {} clients, which is the limit; raise the maximum number of clients",
        module_.name(), most));
  return subscribers_.insert(subscribers_.end(), std::move(subscriber));
}

// ---- the keeper

void Ip330::keep(const std::stop_token& stop) {
  std::unique_lock lock(keeperMutex_);
  while (!stop.stop_requested()) {
    keeperWakes_.wait_for(lock, stop, limits_.lookEvery, [] { return false; });
    if (!stop.stop_requested()) look();
  }
}

void Ip330::look() {
  lookForBoard();
  faults_.set(Ip330Fault::storm, interruptThread_->isStorming());
  if (faults_.has(Ip330Fault::absent)) return;
  lookForScans();
  calibrateWhenDue();
}

void Ip330::lookForBoard() {
  using Presence = Ip330Chip::Presence;
  auto seen = Presence::absent;
  {
    const Lock lock(mutex_);
    if (isReady()) return;
    seen = chip_.presence();
    if (seen != Presence::absent && !module_.problem().empty()) seen = Presence::absent;
    if (seen == Presence::reset) corrections_ = {};  // it may be another board
    if (seen != Presence::absent) begin();
  }
  faults_.set(Ip330Fault::absent, seen == Presence::absent);
  if (seen == Presence::reset) trySetSecondsBetweenCalibrate(settings().secondsBetweenCalibrate);
}

void Ip330::lookForScans() {
  faults_.set(Ip330Fault::interruptsLost, lateInRow_.load(std::memory_order_relaxed) >= kLateInRow);
  bool isSilent = false;
  {
    const Lock lock(mutex_);
    const auto latest = Clock::nowNs() - patience().count();
    isSilent =
        isContinuous(settings_.scanMode) && lastScanNs_.load(std::memory_order_relaxed) < latest;
    if (isSilent && startNs_ < latest && isReady()) {
      epoch_.fetch_add(1, std::memory_order_relaxed);
      start();
    }
  }
  // After a start the state is unknown until a scan comes, so the fault stays unchanged.
  if (isSilent || scans_.load(std::memory_order_relaxed) != scansSeen_)
    faults_.set(Ip330Fault::silent, isSilent);
  scansSeen_ = scans_.load(std::memory_order_relaxed);
}

void Ip330::calibrateWhenDue() {
  {
    const Lock lock(mutex_);
    if (!calibrateAt_.hasPassed()) return;
    calibrateAt_ = Deadline::never();
  }
  static_cast<void>(tryCalibrate());
}

}  // namespace mpf
