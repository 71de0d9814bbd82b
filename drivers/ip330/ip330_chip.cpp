// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_chip.h"

#include <thread>
#include <utility>

#include <mpf/clock.h>

#include "drivers/ip330/ip330_registers.h"
#include "drivers/ip330/ip330_timing.h"

namespace mpf {
namespace {

constexpr std::uint16_t kAllOnes = 0xffff;
constexpr int kMailboxesOfHalf = 16;
// a conversion of all channels takes 480 us
constexpr std::chrono::microseconds kLookAgainAfter{50};
constexpr std::chrono::microseconds kConversion{static_cast<int>(kIp330MicrosecondsPerConversion)};

std::uint16_t sourceOf(Ip330Type type) {
  return type == Ip330Type::differential ? ip330::kSourceDifferential : ip330::kSourceSingleEnded;
}

std::uint16_t controlOf(const Ip330Settings& settings) {
  std::uint16_t control = ip330::kStraightBinary | ip330::kInterruptAfterAll;
  control |= sourceOf(settings.type);
  control |=
      static_cast<std::uint16_t>(static_cast<unsigned>(settings.scanMode) << ip330::kScanModeShift);
  if (settings.trigger == Ip330Trigger::output) control |= ip330::kTriggerOutput;
  if (ip330TimerOf(settings.scanMode, settings.channels(), settings.microsecondsPerScan).isUsed)
    control |= ip330::kTimerEnable;
  return control;
}

}  // namespace

void Ip330Chip::writeControl(std::uint16_t control) {
  control_ = control;
  io_.write16(ip330::kControl, control);
}

void Ip330Chip::start(const Ip330Settings& settings,
                      const std::array<std::uint8_t, kIp330Channels>& gains,
                      std::chrono::nanoseconds limit) {
  stop();
  settle(settings, limit);
  const auto timer =
      ip330TimerOf(settings.scanMode, settings.channels(), settings.microsecondsPerScan);
  // before a trigger can cause an interrupt
  io_.write8(ip330::kInterruptVector, static_cast<std::uint8_t>(settings.vector));
  io_.write8(ip330::kTimerPrescaler, timer.prescaler);
  io_.write16(ip330::kConversionTimer, timer.conversion);
  io_.write8(ip330::kStartChannel, static_cast<std::uint8_t>(settings.firstChannel));
  io_.write8(ip330::kEndChannel, static_cast<std::uint8_t>(settings.lastChannel));
  for (std::size_t i = 0; i < gains.size(); ++i) io_.write8(ip330::kGainSelect + i, gains[i]);
  half_ = 0;
  converting_ = settings.scanMode == Ip330ScanMode::disable ? 0 : settings.channels();
  writeControl(controlOf(settings));
  if (isContinuous(settings.scanMode)) startConvert();
}

void Ip330Chip::stop() {
  writeControl(
      static_cast<std::uint16_t>(control_ & ~(ip330::kScanMode | ip330::kInterruptControl)));
  if (const int channels = std::exchange(converting_, 0); channels > 0)
    std::this_thread::sleep_for(channels * kConversion);
  static_cast<void>(readAllMailboxes());
}

void Ip330Chip::startConvert() { io_.write16(ip330::kStartConvert, 1); }

Ip330Chip::Presence Ip330Chip::presence() {
  const auto control = io_.read16(ip330::kControl);
  if (control == kAllOnes) return Presence::absent;
  return (control & ip330::kControlUsed) == control_ ? Presence::asProgrammed : Presence::reset;
}

void Ip330Chip::take(const Ip330Settings& settings, Scans& scans) {
  scans.count = 0;
  scans.isMissing = false;
  scans.isSettled = isSettled_;
  if (settings.type == Ip330Type::singleEnded || !isContinuous(settings.scanMode)) {
    static_cast<void>(takeHalf(settings, 0, scans));
  } else {
    const int next = half_;
    for (const int half : {next, 1 - next}) {
      if (takeHalf(settings, half, scans)) half_ = 1 - half;
    }
  }
  if (scans.count > 0) isSettled_ = true;
}

// A scan is complete when its last channel has new data.
bool Ip330Chip::takeHalf(const Ip330Settings& settings, int half, Scans& scans) {
  const auto first = static_cast<std::size_t>(half) * kMailboxesOfHalf;
  const auto last = first + static_cast<std::size_t>(settings.lastChannel);
  const auto flagsAt = last / kMailboxesOfHalf * 2;
  const auto flag = 1U << (last % kMailboxesOfHalf);
  if ((io_.read16(ip330::kNewData + flagsAt) & flag) == 0) return false;
  if ((io_.read16(ip330::kMissedData + flagsAt) & flag) != 0) scans.isMissing = true;
  auto& codes = scans.codes[scans.count++];
  for (auto channel = static_cast<std::size_t>(settings.firstChannel); first + channel <= last;
       ++channel) {
    codes[channel] = io_.read16(ip330::kMailBox + 2 * (first + channel));
  }
  return true;
}

std::optional<double> Ip330Chip::tryMeasure(std::uint16_t source, int gain,
                                            std::chrono::nanoseconds limit) {
  for (std::size_t i = 0; i < kIp330Channels; ++i)
    io_.write8(ip330::kGainSelect + i, static_cast<std::uint8_t>(gain));
  prepareSingle(source, kIp330Channels);
  if (!tryConvert(kIp330Channels, limit)) return std::nullopt;
  static_cast<void>(readAllMailboxes());  // this also clears the flags
  if (!tryConvert(kIp330Channels, limit)) return std::nullopt;
  return readAllMailboxes() / static_cast<double>(kIp330Channels);
}

void Ip330Chip::settle(const Ip330Settings& settings, std::chrono::nanoseconds limit) {
  const auto source = sourceOf(settings.type);
  if (((io_.read16(ip330::kControl) ^ source) & ip330::kInputSource) == 0) return;
  prepareSingle(source, channelsOf(settings.type));
  isSettled_ = tryConvert(channelsOf(settings.type), limit);
  stop();
}

// Prepares a burst of channels 0 to channels - 1, without interrupts.
void Ip330Chip::prepareSingle(std::uint16_t source, int channels) {
  const auto burstSingle = static_cast<std::uint16_t>(
      static_cast<unsigned>(Ip330ScanMode::burstSingle) << ip330::kScanModeShift);
  io_.write8(ip330::kStartChannel, 0);
  io_.write8(ip330::kEndChannel, static_cast<std::uint8_t>(channels - 1));
  writeControl(static_cast<std::uint16_t>(burstSingle | ip330::kStraightBinary | source));
}

bool Ip330Chip::tryConvert(int channels, std::chrono::nanoseconds limit) {
  startConvert();
  const auto deadline = Deadline::after(limit);
  for (;;) {
    const bool isLast = deadline.hasPassed();
    const bool isUpperThere =
        channels <= kMailboxesOfHalf || io_.read16(ip330::kNewData + 2) == kAllOnes;
    if (isUpperThere && io_.read16(ip330::kNewData) == kAllOnes) return true;
    if (isLast) return false;
    std::this_thread::sleep_for(kLookAgainAfter);  // polls, since interrupts are off
  }
}

std::uint32_t Ip330Chip::readAllMailboxes() {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < kIp330Channels; ++i) sum += io_.read16(ip330::kMailBox + 2 * i);
  return sum;
}

}  // namespace mpf
