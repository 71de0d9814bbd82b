// SPDX-License-Identifier: MIT
#include "drivers/gpib/instrument_port.h"

#include <utility>

#include "drivers/gpib/command_bytes.h"

namespace mpf {
namespace {

constexpr std::uint8_t kCommandBits = 0x7f;  // the eighth data line is no part of a command
constexpr std::uint8_t kGroupBits = 0x60;
constexpr std::uint8_t kAddressBits = 0x1f;

}  // namespace

GpibInstrumentPort::GpibInstrumentPort(GpibAddress address,
                                       std::shared_ptr<GpibInstrumentModel> instrument)
    : address_(address), instrument_(std::move(instrument)) {}

GpibLines GpibInstrumentPort::follow(const GpibLines& seen) {
  followControl(seen);
  followSource(seen);
  GpibLines driven;
  const bool takesPart = seen.has(gpib_line::kAtn) || isListener_;
  driven.control =
      acceptor_.follow(seen, takesPart, [] { return true; }, [&] { return take(seen); });
  if (instrument_->requestsService()) driven.control |= gpib_line::kSrq;
  if (offered_) {
    driven.control |= gpib_line::kDav;
    if (offered_->end) driven.control |= gpib_line::kEoi;
    driven.data = offered_->value;
  }
  return driven;
}

bool GpibInstrumentPort::offer(const GpibLines& seen) {
  const bool isReady = !seen.has(gpib_line::kNrfd) && seen.has(gpib_line::kNdac);
  if (!mayTalk(seen) || !isReady || offered_) return false;
  offered_ = nextByte();
  return offered_.has_value();
}

void GpibInstrumentPort::powerUp() {
  acceptor_ = {};
  primary_ = Primary::none;
  isListener_ = isTalker_ = isPolled_ = isLockedOut_ = isRemoteEnabled_ = false;
  waiting_.reset();
  offered_.reset();
  enter(Control::local);
}

void GpibInstrumentPort::followControl(const GpibLines& seen) {
  if (seen.has(gpib_line::kIfc)) {
    isListener_ = isTalker_ = isPolled_ = false;
    primary_ = Primary::none;
  }
  isRemoteEnabled_ = seen.has(gpib_line::kRen);
  if (isRemoteEnabled_) return;
  isLockedOut_ = false;
  enter(Control::local);
}

void GpibInstrumentPort::followSource(const GpibLines& seen) {
  if (!offered_) return;
  if (!mayTalk(seen)) {
    if (!isPolled_) waiting_ = offered_;
    offered_.reset();
  } else if (seen.has(gpib_line::kDav) && !seen.has(gpib_line::kNdac)) {
    offered_.reset();
  }
}

bool GpibInstrumentPort::mayTalk(const GpibLines& seen) const noexcept {
  return isTalker_ && !seen.has(gpib_line::kAtn) && !seen.has(gpib_line::kIfc);
}

std::optional<GpibInstrumentModel::Byte> GpibInstrumentPort::nextByte() {
  if (isPolled_) return GpibInstrumentModel::Byte{instrument_->serialPoll(), false};
  if (waiting_) return std::exchange(waiting_, std::nullopt);
  return instrument_->nextByte();
}

bool GpibInstrumentPort::take(const GpibLines& seen) {
  if (seen.has(gpib_line::kAtn)) {
    takeCommand(seen.data & kCommandBits);
    return true;
  }
  if (!accepts_ || !instrument_->receive(seen.data, seen.has(gpib_line::kEoi))) return false;
  waiting_.reset();  // a new command replaces the rest of the answer
  return true;
}

void GpibInstrumentPort::takeCommand(std::uint8_t command) {
  const auto group = command & kGroupBits;
  if (group == gpib_command::kSecondary) return takeSecondary(command & kAddressBits);
  primary_ = Primary::none;
  if (group != 0) return takeAddress(command);
  switch (command) {
    case gpib_command::kLocalLockout:
      isLockedOut_ = isRemoteEnabled_;
      if (control_ != Control::local) enter(Control::remoteWithLockout);
      return;
    case gpib_command::kDeviceClear:
      waiting_.reset();
      return instrument_->clear();
    case gpib_command::kSerialPollEnable:
    case gpib_command::kSerialPollDisable:
      isPolled_ = command == gpib_command::kSerialPollEnable;
      return;
    default:
      if (isListener_) executeAddressed(command);
  }
}

void GpibInstrumentPort::takeAddress(std::uint8_t command) {
  const bool isOwn = (command & kAddressBits) == address_.primary;
  if ((command & kGroupBits) == gpib_command::kTalk) {
    isTalker_ = isTalker_ && isOwn && address_.secondary.has_value();
    if (isOwn && address_.secondary) primary_ = Primary::talk;
    if (isOwn && !address_.secondary) talk();
  } else if (command == gpib_command::kUnlisten) {
    isListener_ = false;
  } else if (isOwn) {
    if (address_.secondary) primary_ = Primary::listen;
    if (!address_.secondary) listen();
  }
}

void GpibInstrumentPort::takeSecondary(std::uint8_t secondary) {
  const bool isOwn = secondary == address_.secondary;
  if (primary_ == Primary::listen && isOwn) listen();
  if (primary_ == Primary::talk && isOwn) talk();
  if (primary_ == Primary::talk && !isOwn) isTalker_ = false;
}

void GpibInstrumentPort::listen() {
  isListener_ = true;
  isTalker_ = false;
  if (isRemoteEnabled_) enter(isLockedOut_ ? Control::remoteWithLockout : Control::remote);
}

void GpibInstrumentPort::talk() {
  isTalker_ = true;
  isListener_ = false;
}

void GpibInstrumentPort::executeAddressed(std::uint8_t command) {
  if (command == gpib_command::kGroupExecuteTrigger) instrument_->trigger();
  if (command == gpib_command::kGoToLocal) enter(Control::local);
  if (command != gpib_command::kSelectedDeviceClear) return;
  waiting_.reset();
  instrument_->clear();
}

void GpibInstrumentPort::enter(Control control) {
  if (std::exchange(control_, control) != control) instrument_->setControl(control);
}

}  // namespace mpf
