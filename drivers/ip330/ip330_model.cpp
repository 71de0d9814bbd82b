// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_model.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/module.h>

#include "base/signals_blocked.h"
#include "drivers/ip330/ip330_registers.h"
#include "drivers/ip330/ip330_timing.h"

namespace mpf {
namespace {

constexpr IdProm kIp330Id{.manufacturer = kAcromag, .model = 0x11};
constexpr double kSecondsPerConversion = kIp330MicrosecondsPerConversion / 1e6;
// Error of the codes before the converter has settled.
constexpr double kSettlingCodes = 300;
// Least pause between two scans, so that other threads can access the registers.
constexpr double kLeastPauseSeconds = 20e-6;
constexpr std::size_t kNewDataWord = ip330::kNewData / 2;
constexpr std::size_t kMissedDataWord = ip330::kMissedData / 2;
constexpr std::size_t kMailBoxWord = ip330::kMailBox / 2;
constexpr std::size_t kHalf = 16;

// The voltage of a calibration source; 0 for the inputs.
double voltsOf(std::uint16_t source) noexcept {
  switch (source) {
    case ip330::kSource4V9000:
      return 4.9;
    case ip330::kSource2V4500:
      return 2.45;
    case ip330::kSource1V2250:
      return 1.225;
    case ip330::kSource0V6125:
      return 0.6125;
    default:
      return 0;
  }
}

bool isInput(std::uint16_t source) noexcept {
  return source == ip330::kSourceDifferential || source == ip330::kSourceSingleEnded;
}

}  // namespace

Ip330Model::Ip330Model(const Ip330ModelOptions& options)
    : DeviceModel(kIp330Id), options_(options), random_(options.seed), bornNs_(Clock::nowNs()) {
  if (!options_.isRealTime) return;
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Ip330Model::~Ip330Model() = default;

double Ip330Model::idealCode(Ip330Range range, int gain, double volts) noexcept {
  const auto [zero, span] = spanOf(range);
  return (volts * kIp330Gain[static_cast<std::size_t>(gain)] - zero) * 65536 / span;
}

void Ip330Model::setSignal(int channel, Ip330Signal signal) {
  const Lock lock(mutex_);
  signals_.at(static_cast<std::size_t>(channel)) = std::move(signal);
}

void Ip330Model::setStuck(bool isStuck) {
  const Lock lock(mutex_);
  isStuck_ = isStuck;
}

void Ip330Model::beginScanBeforeDisable() {
  const Lock lock(mutex_);
  leavesScan_ = true;
}

bool Ip330Model::isEndingScan() {
  const Lock lock(mutex_);
  finishScan();
  return !left_.empty();
}

void Ip330Model::leaveScan() {
  for (int channel = startChannel(); channel <= endChannel(); ++channel) {
    left_.emplace_back(mailboxOf(channel), codeOf(channel, clockSeconds()));
  }
  leftUntilNs_ = Clock::nowNs() + static_cast<std::int64_t>(static_cast<double>(left_.size()) *
                                                            kSecondsPerConversion * 1e9);
}

void Ip330Model::finishScan() {
  if (left_.empty() || Clock::nowNs() < leftUntilNs_) return;
  for (const auto& [mailbox, code] : left_) deliver(mailbox, code);
  left_.clear();
}

void Ip330Model::powerCycle() {
  const Lock lock(mutex_);
  const auto before = control();
  words_ = {};
  obeyControl(before);
}

void Ip330Model::step(int scans) {
  const Lock lock(mutex_);
  for (; scans > 0; --scans) {
    seconds_ += periodSeconds();
    if (isRunning_) scan();
  }
}

void Ip330Model::externalTrigger() {
  const Lock lock(mutex_);
  if ((control() & ip330::kTriggerOutput) != 0) return;
  if (scanMode() != Ip330ScanMode::convertOnExternalTriggerOnly) return start();
  triggered_ =
      triggered_ < startChannel() || triggered_ >= endChannel() ? startChannel() : triggered_ + 1;
  if (isStuck_) return;
  convert(triggered_, clockSeconds());
  if (triggered_ == endChannel()) endScan();
}

Ip330ScanMode Ip330Model::scanMode() const noexcept {
  return static_cast<Ip330ScanMode>((control() & ip330::kScanMode) >> ip330::kScanModeShift);
}

int Ip330Model::gainOf(int channel) const noexcept {
  const auto word = words_[(ip330::kGainSelect + static_cast<std::size_t>(channel)) / 2];
  return (channel % 2 == 0 ? word >> 8 : word) & 3;
}

double Ip330Model::conversionSeconds() const noexcept {
  const double timer = (words_[1] >> 8) * static_cast<double>(words_[2]) / 8e6;
  const auto mode = scanMode();
  const bool isUniform =
      mode == Ip330ScanMode::uniformContinuous || mode == Ip330ScanMode::uniformSingle;
  return isUniform ? std::max(timer, kSecondsPerConversion) : kSecondsPerConversion;
}

double Ip330Model::periodSeconds() const noexcept {
  const double all = (endChannel() - startChannel() + 1) * conversionSeconds();
  if (scanMode() != Ip330ScanMode::burstContinuous) return all;
  return all + (words_[1] >> 8) * static_cast<double>(words_[2]) / 8e6;
}

double Ip330Model::voltsAt(int channel, double seconds) const {
  const std::uint16_t source = control() & ip330::kInputSource;
  if (!isInput(source)) return voltsOf(source);
  const auto& signal = signals_[static_cast<std::size_t>(channel)];
  return signal ? signal(seconds) : 0;
}

std::uint16_t Ip330Model::codeOf(int channel, double seconds) {
  const auto gain = static_cast<std::size_t>(gainOf(channel));
  double code = idealCode(options_.range, static_cast<int>(gain), voltsAt(channel, seconds));
  code = code * (1 + options_.gainError[gain]) + options_.offsetError[gain];
  if (isSettling_) code += kSettlingCodes;
  if (options_.noise > 0) code += options_.noise * noise_(random_);
  const auto straight = static_cast<std::uint16_t>(std::clamp(std::round(code), 0.0, 65535.0));
  return (control() & ip330::kStraightBinary) != 0 ? straight : straight ^ 0x8000;
}

void Ip330Model::start() {
  const auto mode = scanMode();
  half_ = 0;
  ++starts_;
  isRunning_ = isContinuous(mode) && (control() & ip330::kTimerEnable) != 0;
  seconds_ = clockSeconds();
  next_ = seconds_ + (endChannel() - startChannel() + 1) * conversionSeconds();
  if (mode == Ip330ScanMode::uniformSingle || mode == Ip330ScanMode::burstSingle) scan();
  changed_.notify_all();
}

void Ip330Model::scan() {
  if (isStuck_) return;
  for (int channel = startChannel(); channel <= endChannel(); ++channel) {
    convert(channel, seconds_ + (channel - startChannel()) * conversionSeconds());
  }
  endScan();
}

std::size_t Ip330Model::mailboxOf(int channel) const noexcept {
  const bool isDifferential = (control() & ip330::kInputSource) == ip330::kSourceDifferential;
  return isDifferential ? static_cast<std::size_t>(channel) % kHalf + (half_ != 0 ? kHalf : 0)
                        : static_cast<std::size_t>(channel);
}

void Ip330Model::convert(int channel, double seconds) {
  deliver(mailboxOf(channel), codeOf(channel, seconds));
}

void Ip330Model::deliver(std::size_t mailbox, std::uint16_t code) {
  words_[kMailBoxWord + mailbox] = code;
  if (flag(kNewDataWord, mailbox)) setFlag(kMissedDataWord, mailbox, true);
  setFlag(kNewDataWord, mailbox, true);
}

void Ip330Model::endScan() {
  isSettling_ = false;
  if (isContinuous(scanMode())) half_ = 1 - half_;
  if ((control() & ip330::kInterruptControl) != 0) setInterrupt(0, true);
}

bool Ip330Model::flag(std::size_t firstWord, std::size_t mailbox) const noexcept {
  return (words_[firstWord + mailbox / kHalf] >> (mailbox % kHalf) & 1) != 0;
}

void Ip330Model::setFlag(std::size_t firstWord, std::size_t mailbox, bool isSet) {
  auto& word = words_[firstWord + mailbox / kHalf];
  const auto bit = static_cast<std::uint16_t>(1U << (mailbox % kHalf));
  word = static_cast<std::uint16_t>(isSet ? word | bit : word & ~bit);
}

std::uint16_t Ip330Model::readMailbox(std::size_t mailbox) {
  setFlag(kNewDataWord, mailbox, false);
  setFlag(kMissedDataWord, mailbox, false);
  const auto last = static_cast<std::size_t>(endChannel());
  const bool isDifferential = (control() & ip330::kInputSource) == ip330::kSourceDifferential;
  if (mailbox == last || (isDifferential && mailbox % kHalf == last % kHalf))
    setInterrupt(0, false);
  return words_[kMailBoxWord + mailbox];
}

void Ip330Model::obeyControl(std::uint16_t before) {
  if (((before ^ control()) & ip330::kInputSource) != 0) isSettling_ = true;
  if (!isContinuous(scanMode()) && std::exchange(isRunning_, false) &&
      std::exchange(leavesScan_, false))
    leaveScan();
  if ((control() & ip330::kInterruptControl) == 0) setInterrupt(0, false);
}

std::uint16_t Ip330Model::read(Space space, std::size_t offset, Lanes /*lanes*/) {
  const Lock lock(mutex_);
  finishScan();
  const auto word = offset / 2;
  if (space != Space::io || word >= kWords) return 0xffff;
  return word >= kMailBoxWord ? readMailbox(word - kMailBoxWord) : words_[word];
}

void Ip330Model::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  const Lock lock(mutex_);
  finishScan();
  const auto word = offset / 2;
  if (space != Space::io || word >= kMailBoxWord ||
      (word >= kNewDataWord && word < kMissedDataWord + 2))
    return;
  if (offset == ip330::kStartConvert) {
    if ((value & lanes & 1) != 0) start();
    return;
  }
  const auto before = std::exchange(
      words_[word], static_cast<std::uint16_t>((words_[word] & ~lanes) | (value & lanes)));
  if (offset == ip330::kControl) obeyControl(before);
}

double Ip330Model::clockSeconds() const noexcept {
  return options_.isRealTime ? static_cast<double>(Clock::nowNs() - bornNs_) / 1e9 : seconds_;
}

void Ip330Model::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (!isRunning_) {
      changed_.wait(lock, stop, [&] { return isRunning_; });
      continue;
    }
    const auto left = next_ - clockSeconds();
    if (left > 0) {
      changed_.wait_for(lock, stop, std::chrono::duration<double>(left),
                        [&, seen = starts_] { return starts_ != seen; });
      continue;
    }
    seconds_ = next_;
    scan();
    // after a delay the model does not catch up
    next_ = std::max(next_ + periodSeconds(), clockSeconds() + kLeastPauseSeconds);
  }
}

}  // namespace mpf
