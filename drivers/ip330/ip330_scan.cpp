// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_scan.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace mpf {
namespace {

// How often a waiting reader checks that the board still scans.
constexpr std::chrono::milliseconds kLookAtBoard{10};

}  // namespace

void expectIp330Channels(const Ip330& board, int first, int last) {
  if (const auto problem = board.settings().problemOfChannels(first, last); !problem.empty())
    throw std::invalid_argument(problem);
}

Ip330Scan::Ip330Scan(Ip330& board, int first, int last)
    : board_(board), first_(first), last_(last) {
  expectIp330Channels(board, first, last);
  channels_.resize(static_cast<std::size_t>(last) - static_cast<std::size_t>(first) + 1);
  subscription_ = board.subscribe([this](const Ip330Sample& sample) { take(sample); });
}

void Ip330Scan::take(const Ip330Sample& sample) {
  const std::lock_guard lock(mutex_);
  for (int number = first_; number <= last_; ++number) {
    if (!sample.isValid(number)) continue;
    auto& channel = channels_[static_cast<std::size_t>(number - first_)];
    const auto at = static_cast<std::size_t>(number);
    const bool isNew = channel.gain != sample.gain[at] || channel.epoch != sample.epoch;
    channel.gain = sample.gain[at];
    channel.epoch = sample.epoch;
    if (isNew) {
      channel.mean.restart();
      channel.readAt = 0;
    }
    channel.mean.add(sample.corrected[at]);
  }
  came_.notify_all();
}

void Ip330Scan::stop() {
  const std::lock_guard lock(mutex_);
  isStopped_ = true;
  came_.notify_all();
}

// The number of samples in a time; 0 means all since the last reading. nullopt: the time is
// invalid.
std::optional<std::uint64_t> Ip330Scan::samplesOf(std::chrono::milliseconds average) const {
  if (average.count() < 0) return std::nullopt;
  if (average.count() == 0) return 0;
  const double period = board_.microsecondsPerScan();
  if (period <= 0) return 1;
  const double samples =
      std::max(std::round(static_cast<double>(average.count()) * 1000 / period), 1.0);
  if (samples > static_cast<double>(kIp330LongestMean)) return std::nullopt;
  return static_cast<std::uint64_t>(samples);
}

// Called with mutex_ held.
bool Ip330Scan::hasSample(int channel, int gain) const {
  const auto& state = channels_[static_cast<std::size_t>(channel - first_)];
  return state.gain == gain && state.epoch == board_.epoch() && state.mean.count() != 0;
}

// Called without mutex_: the board calls take() while it holds its own lock.
bool Ip330Scan::comes(int channel, int gain) const {
  return board_.isDelivering() && isContinuous(board_.settings().scanMode) &&
         board_.gain(channel) == gain;
}

bool Ip330Scan::waitForSample(std::unique_lock<std::mutex>& lock, int channel, int gain) {
  const auto deadline = Deadline::after(board_.patience());
  while (!hasSample(channel, gain)) {
    if (isStopped_ || deadline.hasPassed()) return false;
    lock.unlock();
    const bool mayCome = comes(channel, gain);
    lock.lock();
    if (hasSample(channel, gain)) return true;
    if (!mayCome) return false;
    came_.wait_for(lock, kLookAtBoard);
  }
  return true;
}

std::optional<int> Ip330Scan::tryRead(int channel, int gain, std::chrono::milliseconds average) {
  const auto samples = samplesOf(average);
  if (channel < first_ || channel > last_ || !samples || !board_.isDelivering() ||
      !board_.trySetGain(channel, gain))
    return std::nullopt;
  auto& state = channels_[static_cast<std::size_t>(channel - first_)];
  std::unique_lock lock(mutex_);
  state.mean.reserve(*samples);
  if (!waitForSample(lock, channel, gain)) return std::nullopt;
  if (*samples > 0) return clampedCode(state.mean.mean(*samples));
  const auto since = state.mean.count() - std::exchange(state.readAt, state.mean.count());
  state.mean.reserve(std::min(since, kIp330LongestMean));
  return clampedCode(state.mean.mean(std::max<std::uint64_t>(since, 1)));
}

}  // namespace mpf
