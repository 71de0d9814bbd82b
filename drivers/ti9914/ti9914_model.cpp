// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_model.h"

#include <utility>

#include "drivers/ti9914/ti9914.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data manual
using namespace ti9914;

constexpr std::uint8_t kRevision = 0xa1;
constexpr std::uint8_t kUndriven = 0xff;
constexpr std::uint16_t kUndrivenHigh = 0xff00;

}  // namespace

Ti9914Model::Ti9914Model(std::shared_ptr<GpibBusModel> bus, std::function<std::int64_t()> now)
    : DeviceModel({.manufacturer = kIp488.manufacturer,
                   .model = kIp488.models.front(),
                   .revision = kRevision}),
      bus_(std::move(bus)),
      now_(std::move(now)) {
  bus_->connect(*this);
}

Ti9914Model::~Ti9914Model() { bus_->disconnect(*this); }

std::uint64_t Ti9914Model::lostCommands() const {
  return bus_->look([&](const GpibLines& /*lines*/) { return lostCommands_; });
}

int Ti9914Model::vector() const {
  return bus_->look([&](const GpibLines& /*lines*/) { return vector_; });
}

// ---- registers

std::uint16_t Ti9914Model::read(Space space, std::size_t offset, Lanes lanes) {
  if (space != Space::io || (lanes & kLow) == 0) return kUndrivenHigh | kUndriven;
  const auto act = [&](const GpibLines& lines) -> std::uint16_t {
    return kUndrivenHigh | readRegister(offset + 1, lines);
  };
  if (offset + 1 == kDir) return bus_->access(act);
  const auto value = bus_->look(act);
  // A driver that waits gives slow instruments the chance to go on.
  if (offset + 1 == kIsr0 && value == kUndrivenHigh) bus_->proceed();
  return value;
}

void Ti9914Model::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  if (space != Space::io || (lanes & kLow) == 0) return;
  bus_->access([&](const GpibLines& lines) {
    writeRegister(offset + 1, static_cast<std::uint8_t>(value), lines);
    followInterrupt();
  });
}

std::uint8_t Ti9914Model::readRegister(std::size_t offset, const GpibLines& lines) {
  switch (offset) {
    case kIsr0: {
      const auto summary = ((isr0_ & imr0_) != 0 ? kInt0 : 0) | ((isr1_ & imr1_) != 0 ? kInt1 : 0);
      const auto value = static_cast<std::uint8_t>(std::exchange(isr0_, 0) | summary);
      followInterrupt();
      return value;
    }
    case kIsr1: {
      const auto value = std::exchange(isr1_, 0);
      followInterrupt();
      return value;
    }
    case kAdsr:
      return static_cast<std::uint8_t>((states_.isTalker ? kTalkerAddressed : 0) |
                                       (states_.isListener ? kListenerAddressed : 0) |
                                       (lines.has(gpib_line::kAtn) ? kAttention : 0));
    case kBsr:
      return lines.control;
    case kCptr:
      return lines.data;
    case kDir:
      hasInput_ = false;
      isr0_ &= ~(kBi | kEnd);
      followInterrupt();
      return input_;
    case kVector:
      return vector_;
    default:
      return kUndriven;
  }
}

void Ti9914Model::writeRegister(std::size_t offset, std::uint8_t value, const GpibLines& lines) {
  switch (offset) {
    case kImr0:
      imr0_ = value;
      return;
    case kImr1:
      imr1_ = value;
      return;
    case kAuxcr:
      return command(value, lines);
    case kCdor:
      isr0_ &= ~kBo;
      if (!states_.isReset && !isOffered_)
        output_ = OutputByte{value, std::exchange(forcesEnd_, false)};
      hasNoAcceptor_ = false;
      return;
    case kVector:
      vector_ = value;
      return;
    default:
      return;  // ADR, SPMR, PPR: for the chip as a device
  }
}

void Ti9914Model::command(std::uint8_t command, const GpibLines& lines) {
  const auto now = now_();
  if (now - std::exchange(commandAtNs_, now) < kAuxSpacingNs) {
    ++lostCommands_;
    return;
  }
  execute(command & ~kSet, (command & kSet) != 0, lines);
}

void Ti9914Model::execute(std::uint8_t command, bool set, const GpibLines& lines) {
  if (command == kSwrst) return reset(set);
  if (command == kDai) states_.hasNoInterrupts = set;
  if (states_.isReset) return;
  switch (command) {
    case kRhdf:
      holdsOff_ = false;
      return;
    case kHdfa:
      states_.holdsOffAll = set;
      return;
    case kHdfe:
      states_.holdsOffEnd = set;
      return;
    case kNbaf:
      if (!isOffered_) output_.reset();
      return;
    case kFeoi:
      forcesEnd_ = true;
      return;
    case kLon:
      states_.isListener = set;
      return;
    case kTon:
      states_.isTalker = set;
      return;
    case kGts:
      states_.drivesAttention = false;
      return;
    case kTcs:
      if (!lines.has(gpib_line::kDav)) takeControl();
      return;
    case kTca:
      return takeControl();
    case kSic:
      states_.drivesInterfaceClear = set;
      if (!set) return;
      states_.isInCharge = true;
      return takeControl();
    case kSre:
      states_.drivesRemoteEnable = set;
      return;
    default:
      return;
  }
}

void Ti9914Model::takeControl() noexcept { states_.drivesAttention = states_.isInCharge; }

void Ti9914Model::reset(bool on) {
  states_ = {.isReset = on,
             .holdsOffAll = states_.holdsOffAll,
             .holdsOffEnd = states_.holdsOffEnd,
             .hasNoInterrupts = states_.hasNoInterrupts};
  acceptor_ = {};
  source_ = Source::none;
  output_.reset();
  isOffered_ = hasNoAcceptor_ = forcesEnd_ = hasInput_ = holdsOff_ = sawServiceRequest_ = false;
  isr0_ = isr1_ = 0;
}

// ---- lines

GpibLines Ti9914Model::follow(const GpibLines& seen) {
  if (states_.isReset) return {};
  followSource(seen);
  GpibLines driven;
  driven.control = followAcceptor(seen);
  if (states_.drivesAttention) driven.control |= gpib_line::kAtn;
  if (states_.drivesInterfaceClear) driven.control |= gpib_line::kIfc;
  if (states_.drivesRemoteEnable) driven.control |= gpib_line::kRen;
  if (isOffered_) {
    driven.control |= gpib_line::kDav;
    if (output_->end) driven.control |= gpib_line::kEoi;
    driven.data = output_->value;
  }
  const bool isRequested = seen.has(gpib_line::kSrq);
  if (!std::exchange(sawServiceRequest_, isRequested) && isRequested) raise(isr1_, ti9914::kSrq);
  return driven;
}

bool Ti9914Model::offer(const GpibLines& seen) {
  const bool isReady = !seen.has(gpib_line::kNrfd);
  if (source_ == Source::none || !output_ || isOffered_ || !isReady) return false;
  isOffered_ = seen.has(gpib_line::kNdac);
  if (!isOffered_ && !std::exchange(hasNoAcceptor_, true)) raise(isr1_, kErr);
  return isOffered_;
}

bool Ti9914Model::seesAttention(const GpibLines& seen) const noexcept {
  return states_.drivesAttention || seen.has(gpib_line::kAtn);
}

void Ti9914Model::followSource(const GpibLines& seen) {
  auto now = Source::none;
  if (states_.drivesAttention) now = Source::commands;
  if (states_.isTalker && !seesAttention(seen)) now = Source::data;
  if (now != std::exchange(source_, now)) {
    isOffered_ = false;  // the byte stays in CDOR
    if (now != Source::none && !output_) raise(isr0_, kBo);
  }
  if (!isOffered_ || !seen.has(gpib_line::kDav) || seen.has(gpib_line::kNdac)) return;
  isOffered_ = false;
  output_.reset();
  raise(isr0_, kBo);
}

std::uint8_t Ti9914Model::followAcceptor(const GpibLines& seen) {
  const bool takesPart = states_.isListener && !seesAttention(seen);
  return acceptor_.follow(
      seen, takesPart, [&] { return !holdsOff_ && !hasInput_; }, [&] { return take(seen); });
}

bool Ti9914Model::take(const GpibLines& seen) {
  const bool isEnd = seen.has(gpib_line::kEoi);
  input_ = seen.data;
  hasInput_ = true;
  holdsOff_ = states_.holdsOffAll || (states_.holdsOffEnd && isEnd);
  raise(isr0_, isEnd ? kBi | kEnd : kBi);
  return true;
}

// ---- interrupt

void Ti9914Model::raise(std::uint8_t& isr, std::uint8_t events) {
  isr |= events;
  followInterrupt();
}

void Ti9914Model::followInterrupt() {
  const bool hasEvent = (isr0_ & imr0_) != 0 || (isr1_ & imr1_) != 0;
  const bool isEnabled = !states_.hasNoInterrupts && (vector_ & kVectorEnabled) != 0;
  const bool isActive = hasEvent && isEnabled;
  if (std::exchange(isInterrupting_, isActive) != isActive) setInterrupt(0, isActive);
}

}  // namespace mpf
