// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_sweep.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

#include "drivers/ip330/ip330_scan.h"

namespace mpf {
namespace {

bool isTime(double seconds) { return std::isfinite(seconds) && seconds >= 0; }

int scansPerPoint(const Ip330& board, double secondsPerPoint) {
  const double period = board.microsecondsPerScan();
  return period > 0
             ? static_cast<int>(std::clamp(std::round(secondsPerPoint * 1e6 / period), 1.0, 1e9))
             : 1;
}

}  // namespace

Ip330Sweep::Ip330Sweep(Ip330& board, int first, int last, int maxPoints)
    : board_(board), first_(first), last_(last), maxPoints_(maxPoints), points_(maxPoints) {
  expectIp330Channels(board, first, last);
  if (maxPoints < 1 || maxPoints > kIp330MostPoints)
    throw std::invalid_argument(fmt::format("{} points: use 1 to {}", maxPoints, kIp330MostPoints));
  const auto channels = static_cast<std::size_t>(last) - static_cast<std::size_t>(first) + 1;
  sums_.resize(channels);
  data_.assign(channels, std::vector<std::int32_t>(static_cast<std::size_t>(maxPoints)));
  subscription_ = board.subscribe([this](const Ip330Sample& sample) { take(sample); });
}

void Ip330Sweep::take(const Ip330Sample& sample) {
  const std::lock_guard lock(mutex_);
  endWhenDue();
  if (!isAcquiring_) return;
  for (int channel = first_; channel <= last_; ++channel) {
    if (!sample.isValid(channel)) return;
  }
  for (std::size_t i = 0; i < sums_.size(); ++i)
    sums_[i] += sample.corrected[static_cast<std::size_t>(first_) + i];
  if (++scans_ >= scansPerPoint(board_, secondsPerPoint_)) addPoint();
}

void Ip330Sweep::addPoint() {
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    data_[i][static_cast<std::size_t>(acquired_)] = clampedCode(sums_[i] / scans_);
  }
  std::ranges::fill(sums_, 0);
  scans_ = 0;
  ++acquired_;
  endWhenDue();
}

void Ip330Sweep::endWhenDue() {
  const bool isOver = presetSeconds_ > 0 && elapsedSeconds_ + secondsSinceStart() >= presetSeconds_;
  if (!isAcquiring_ || (acquired_ < points_ && !isOver)) return;
  elapsedSeconds_ += secondsSinceStart();
  isAcquiring_ = false;
}

double Ip330Sweep::secondsSinceStart() const {
  return isAcquiring_ ? static_cast<double>(Clock::nowNs() - startNs_) / 1e9 : 0;
}

void Ip330Sweep::start() {
  const std::lock_guard lock(mutex_);
  if (isAcquiring_ || acquired_ >= points_) return;
  isAcquiring_ = true;
  startNs_ = Clock::nowNs();
  scans_ = 0;
  std::ranges::fill(sums_, 0);
}

void Ip330Sweep::stop() {
  const std::lock_guard lock(mutex_);
  elapsedSeconds_ += secondsSinceStart();
  isAcquiring_ = false;
}

void Ip330Sweep::erase() {
  const std::lock_guard lock(mutex_);
  for (auto& points : data_) std::ranges::fill(points, 0);
  std::ranges::fill(sums_, 0);
  acquired_ = 0;
  scans_ = 0;
  elapsedSeconds_ = 0;
  startNs_ = Clock::nowNs();
}

bool Ip330Sweep::trySetPoints(double points) {
  const bool isPossible = points >= 1 && points <= maxPoints_;  // false for NaN, too
  if (!isPossible) return false;
  const std::lock_guard lock(mutex_);
  points_ = static_cast<int>(points);
  endWhenDue();
  return true;
}

bool Ip330Sweep::trySetSecondsPerPoint(double seconds) {
  if (!isTime(seconds)) return false;
  const std::lock_guard lock(mutex_);
  secondsPerPoint_ = seconds;
  scans_ = 0;
  std::ranges::fill(sums_, 0);
  return true;
}

bool Ip330Sweep::trySetPreset(double seconds) {
  if (!isTime(seconds)) return false;
  const std::lock_guard lock(mutex_);
  presetSeconds_ = seconds;
  return true;
}

Ip330Sweep::Status Ip330Sweep::status() {
  const std::lock_guard lock(mutex_);
  endWhenDue();
  return {.isAcquiring = isAcquiring_,
          .elapsedSeconds = elapsedSeconds_ + secondsSinceStart(),
          .secondsPerPoint =
              scansPerPoint(board_, secondsPerPoint_) * board_.microsecondsPerScan() / 1e6,
          .acquired = acquired_};
}

std::optional<std::vector<std::int32_t>> Ip330Sweep::tryRead(int channel) {
  if (channel < first_ || channel > last_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto& points = data_[static_cast<std::size_t>(channel - first_)];
  return std::vector(points.begin(), points.begin() + points_);
}

}  // namespace mpf
