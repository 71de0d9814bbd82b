// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io_model.h"

#include <utility>

namespace mpf {
namespace {

namespace word = digital_io_word;
using Driver = DigitalIoKind::Driver;

constexpr std::uint16_t kOnes = 0xffff;
constexpr std::uint16_t kVectorBits = 0xff;

constexpr std::uint32_t bitOf(std::size_t bit) noexcept { return std::uint32_t{1} << bit; }

std::uint16_t half(std::uint32_t bits, std::size_t which) noexcept {
  return static_cast<std::uint16_t>(bits >> (16 * which));
}

// The value read from a register that has only the bits in `mask`: the module does not drive the
// others, and the carrier pulls them up.
std::uint16_t half(std::uint32_t bits, std::uint32_t mask, std::size_t which) noexcept {
  return half(bits | ~mask, which);
}

template <class Word>
void merge(Word& into, std::uint32_t value, std::uint32_t mask) noexcept {
  into = static_cast<Word>((into & ~mask) | (value & mask));
}

}  // namespace

DigitalIoModel::DigitalIoModel(const DigitalIoKind& kind, OnOutput onOutput)
    : DeviceModel({.manufacturer = kind.manufacturer, .model = kind.model, .revision = 0xa1}),
      kind_(kind),
      onOutput_(std::move(onOutput)) {
  const std::lock_guard lock(mutex_);
  follow();
}

std::uint16_t DigitalIoModel::read(Space space, std::size_t offset, Lanes /*lanes*/) {
  if (space != Space::io) return 0;
  const std::lock_guard lock(mutex_);
  follow();
  return readWord(offset / 2);
}

void DigitalIoModel::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  if (space != Space::io) return;
  const std::lock_guard lock(mutex_);
  follow();  // earlier edges are subject to the masks before this write
  writeWord(offset / 2, value, lanes);
  follow();
}

std::uint16_t DigitalIoModel::readWord(std::size_t at) const {
  if (kind_.isSystran()) {
    if (at == word::kSystranEnable) return registers_.control;
    if (at == word::kSystranDirection) return registers_.direction;
    if (at > word::kSystranDirection) return kOnes;
  }
  if (at == word::kThreshold && kind_.hasThreshold)
    return half(registers_.threshold, kMaxThreshold, 0);
  const auto edges = kind_.hasInterrupts ? kind_.inputs : 0;
  switch (at) {
    case word::kOutput:
    case word::kOutput + 1:
      return half(registers_.output, kind_.outputs, at - word::kOutput);
    case word::kInput:
    case word::kInput + 1:
      return half(inputs_, kind_.inputs, at - word::kInput);
    case word::kOutputEnable:
    case word::kOutputEnable + 1:
      return half(registers_.outputEnable, kind_.driver == Driver::switched ? kind_.outputs : 0,
                  at - word::kOutputEnable);
    case word::kControl:
      return registers_.control;
    case word::kVector:
      return half(registers_.vector, kind_.hasInterrupts ? kVectorBits : 0, 0);
    case word::kInterruptEnable:
    case word::kInterruptEnable + 1:
      return half(registers_.interruptEnable, edges, at - word::kInterruptEnable);
    case word::kPolarity:
    case word::kPolarity + 1:
      return half(registers_.polarity, edges, at - word::kPolarity);
    case word::kPending:
    case word::kPending + 1:
      return half(registers_.pending, edges, at - word::kPending);
    default:
      return kOnes;
  }
}

void DigitalIoModel::writeWord(std::size_t at, std::uint16_t value, Lanes lanes) {
  const auto whole = [&](std::uint16_t& reg, std::uint32_t mask) {
    merge(reg, value, mask & lanes);
  };
  const auto pair = [&](std::uint32_t& reg, std::size_t which, std::uint32_t mask) {
    merge(reg, std::uint32_t{value} << (16 * which), (std::uint32_t{lanes} << (16 * which)) & mask);
  };
  if (at == word::kOutput || at == word::kOutput + 1) {
    pair(registers_.output, at, kind_.outputs);
    registers_.output &= ~stuck_;
    return;
  }
  if (kind_.isSystran()) {
    if (at == word::kSystranEnable) whole(registers_.control, 0xffff);
    if (at == word::kSystranDirection) whole(registers_.direction, 0xffff);
    return;
  }
  if (at == word::kThreshold && kind_.hasThreshold)
    return whole(registers_.threshold, kMaxThreshold);
  if (at == word::kControl) return whole(registers_.control, 0xffff);
  if (at == word::kOutputEnable || at == word::kOutputEnable + 1) {
    if (kind_.driver == Driver::switched)
      pair(registers_.outputEnable, at - word::kOutputEnable, kind_.outputs);
    return;
  }
  if (!kind_.hasInterrupts) return;
  if (at == word::kVector) return whole(registers_.vector, kVectorBits);
  if (at == word::kInterruptEnable || at == word::kInterruptEnable + 1)
    return pair(registers_.interruptEnable, at - word::kInterruptEnable, kind_.inputs);
  if (at == word::kPolarity || at == word::kPolarity + 1)
    return pair(registers_.polarity, at - word::kPolarity, kind_.inputs);
  if (at == word::kPending || at == word::kPending + 1)
    registers_.pending &=
        ~(std::uint32_t{static_cast<std::uint16_t>(value & lanes)} << (16 * (at - word::kPending)));
}

// Lines that the module drives, high or low.
std::uint32_t DigitalIoModel::drivenLocked() const {
  if (kind_.controlBits != 0 && (registers_.control & kind_.controlBits) != kind_.controlBits)
    return 0;
  switch (kind_.driver) {
    case Driver::none:
      return 0;
    case Driver::openCollector:
      return kind_.outputs & ~registers_.output;
    case Driver::switched:
      return registers_.outputEnable;
    case Driver::separate:
      return !kind_.isSystran() || registers_.control != 0 ? kind_.outputs : 0;
  }
  return 0;
}

double DigitalIoModel::voltsOf(std::size_t bit) const {
  const bool isReadBack = kind_.driver == Driver::openCollector || kind_.driver == Driver::switched;
  if (isReadBack && (drivenLocked() & bitOf(bit)) != 0)
    return (registers_.output & bitOf(bit)) != 0 ? kHighVolts : 0;
  return outside_[bit] ? outside_[bit]() : kHighVolts;
}

std::uint32_t DigitalIoModel::levels() const {
  const auto threshold =
      kind_.hasThreshold ? registers_.threshold * kThresholdStepVolts : kTtlThresholdVolts;
  std::uint32_t levels = 0;
  for (std::size_t bit = 0; bit < outside_.size(); ++bit) {
    if ((kind_.inputs & bitOf(bit)) != 0 && voltsOf(bit) >= threshold) levels |= bitOf(bit);
  }
  return levels;
}

// Brings the model up to date: reports outputs, reads the lines into the inputs, turns edges into
// pending bits and those into the interrupt request.
void DigitalIoModel::follow() {
  // a line that is not driven is pulled up
  const auto high = ~(drivenLocked() & ~registers_.output);
  const auto news = std::exchange(told_, high) ^ high;
  for (std::size_t bit = 0; onOutput_ && bit < outside_.size(); ++bit) {
    if ((news & kind_.outputs & bitOf(bit)) != 0)
      onOutput_(static_cast<int>(bit), (high & bitOf(bit)) != 0 ? kHighVolts : 0);
  }
  const auto before = std::exchange(inputs_, levels());
  const auto wanted = (inputs_ & registers_.polarity) | (~inputs_ & ~registers_.polarity);
  registers_.pending |= (before ^ inputs_) & wanted & registers_.interruptEnable;
  if (kind_.hasInterrupts) setInterrupt(0, (registers_.pending & registers_.interruptEnable) != 0);
}

void DigitalIoModel::setInputs(std::uint32_t mask, std::uint32_t bits) {
  const std::lock_guard lock(mutex_);
  for (std::size_t bit = 0; bit < outside_.size(); ++bit) {
    if ((mask & bitOf(bit)) == 0) continue;
    const double volts = (bits & bitOf(bit)) != 0 ? kHighVolts : 0;
    outside_[bit] = [volts] { return volts; };
  }
  follow();
}

void DigitalIoModel::connect(int bit, Volts volts) {
  const std::lock_guard lock(mutex_);
  outside_.at(static_cast<std::size_t>(bit)) = std::move(volts);
  follow();
}

void DigitalIoModel::look() {
  const std::lock_guard lock(mutex_);
  follow();
}

std::uint32_t DigitalIoModel::inputs() const {
  const std::lock_guard lock(mutex_);
  return inputs_;
}

std::uint32_t DigitalIoModel::outputs() const {
  const std::lock_guard lock(mutex_);
  return registers_.output & kind_.outputs;
}

std::uint32_t DigitalIoModel::driven() const {
  const std::lock_guard lock(mutex_);
  return drivenLocked();
}

int DigitalIoModel::vector() const {
  const std::lock_guard lock(mutex_);
  return registers_.vector;
}

void DigitalIoModel::setStuck(std::uint32_t bits) {
  const std::lock_guard lock(mutex_);
  stuck_ = bits;
}

}  // namespace mpf
