// SPDX-License-Identifier: MIT
#include <mpf/drivers/dac128v.h>

#include <algorithm>

namespace mpf {
namespace {

constexpr std::uint16_t kOnes = 0xffff;  // no module answers, or the code is 4095

bool isChannel(int channel) noexcept { return channel >= 0 && channel < Dac128v::kChannels; }
std::size_t offsetOf(std::size_t channel) noexcept { return channel * 2; }
// The module does not store the upper four bits; they read as anything.
int codeIn(std::uint16_t word) noexcept { return word & Dac128v::kMaxCode; }

}  // namespace

const char* toString(Dac128vStatus status) noexcept {
  switch (status) {
    case Dac128vStatus::success:
      return "success";
    case Dac128vStatus::noChannel:
      return "no such channel; channels are 0 to 7";
    case Dac128vStatus::outOfRange:
      return "out of range: codes are 0 to 4095";
    case Dac128vStatus::readBackDiffers:
      return "the register does not hold what was written";
    case Dac128vStatus::gone:
      return "the module is absent, or another module is in its place";
  }
  return "unknown";
}

Dac128vStatus Dac128v::tryWrite(int channel, int code) noexcept {
  if (!isChannel(channel)) return Dac128vStatus::noChannel;
  if (code < 0 || code > kMaxCode) return Dac128vStatus::outOfRange;
  const auto at = static_cast<std::size_t>(channel);
  const std::lock_guard lock(mutex_);
  if (!isReady()) return Dac128vStatus::gone;
  const auto held = writeAndReadBack(at, code);
  if (!held) return Dac128vStatus::gone;
  written_[at] = *held == code ? held : std::nullopt;
  return *held == code ? Dac128vStatus::success : Dac128vStatus::readBackDiffers;
}

std::optional<int> Dac128v::tryRead(int channel) noexcept {
  if (!isChannel(channel)) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto word = registers_.read16(offsetOf(static_cast<std::size_t>(channel)));
  return word == kOnes && !module_.problem().empty() ? std::nullopt : std::optional(codeIn(word));
}

// Returns whether the module may be written to. A register that has changed by itself means another
// module, or this one after a reset; after a reset the outputs are restored first.
bool Dac128v::isReady() noexcept {
  if (holdsWhatWasWritten()) return true;
  return module_.problem().empty() && tryRestore();
}

// Checks one channel that was written: preferably one whose code is neither the power-up code nor
// all ones, since a reset or an absent module would not change that reading. Without a written
// channel the result is false.
bool Dac128v::holdsWhatWasWritten() noexcept {
  auto found = std::ranges::find_if(written_, [](const auto& code) {
    return code && *code != kPowerUpCode && *code != kMaxCode;
  });
  if (found == written_.end())
    found = std::ranges::find_if(written_,
                                 [](const auto& code) { return code && *code != kPowerUpCode; });
  if (found == written_.end())
    found = std::ranges::find_if(written_, [](const auto& code) { return code.has_value(); });
  if (found == written_.end()) return false;
  const auto word = registers_.read16(offsetOf(static_cast<std::size_t>(found - written_.begin())));
  return word != kOnes && *found == codeIn(word);
}

// Writes the last code of each channel again. Returns false when the module is gone again.
bool Dac128v::tryRestore() noexcept {
  bool isNews = false;
  for (std::size_t channel = 0; channel < written_.size(); ++channel) {
    auto& code = written_[channel];
    if (!code || codeIn(registers_.read16(offsetOf(channel))) == *code) continue;
    isNews = true;
    const auto held = writeAndReadBack(channel, *code);
    if (!held) return false;
    if (held != code) code.reset();  // the register is broken and can no longer show a reset
  }
  if (isNews) restorations_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

// Returns the code that the register then holds; nullopt when the module is gone.
std::optional<int> Dac128v::writeAndReadBack(std::size_t channel, int code) noexcept {
  registers_.write16(offsetOf(channel), static_cast<std::uint16_t>(code));
  const auto word = registers_.read16(offsetOf(channel));
  return word == kOnes && !module_.problem().empty() ? std::nullopt : std::optional(codeIn(word));
}

}  // namespace mpf
