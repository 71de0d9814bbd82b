// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_model.h"

#include <linux/usb/tmc.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <chrono>
#include <thread>
#include <utility>

#include <mpf/clock.h>

namespace mpf {
namespace {

using Control = GpibInstrumentModel::Control;

constexpr std::uint32_t kShortestTimeoutMs = 100;
constexpr std::chrono::milliseconds kInstrumentPause{1};  // at an instrument that is not ready

std::uint8_t& byteAt(void* argument) { return *static_cast<std::uint8_t*>(argument); }

}  // namespace

int UsbtmcModel::open() {
  if (!isPlugged_) return -ENOENT;
  isGone_ = false;
  sendsEnd_ = true;
  stopAt_ = -1;
  return 0;
}

int UsbtmcModel::begin() { return isGone_ ? -ENODEV : -std::exchange(failOnce_, 0); }

std::int64_t UsbtmcModel::write(std::span<const std::uint8_t> bytes) {
  if (const int error = begin(); error != 0) return error;
  const auto giveUp = Deadline::after(std::chrono::milliseconds(timeoutMs_));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool end = sendsEnd_ && i + 1 == bytes.size();
    while (!instrument_->receive(bytes[i], end)) {
      if (giveUp.hasPassed()) return -ETIMEDOUT;
      std::this_thread::sleep_for(kInstrumentPause);
    }
  }
  return static_cast<std::int64_t>(bytes.size());
}

std::int64_t UsbtmcModel::read(std::span<std::uint8_t> bytes) {
  if (const int error = begin(); error != 0) return error;
  const auto giveUp = Deadline::after(std::chrono::milliseconds(timeoutMs_));
  attributes_ = 0;
  std::size_t length = 0;
  while (length < bytes.size() && attributes_ == 0) {
    const auto byte = instrument_->nextByte();
    if (byte) {
      bytes[length++] = byte->value;
      if (byte->end) attributes_ |= kUsbtmcEndOfMessage;
      if (byte->value == stopAt_) attributes_ |= kUsbtmcStoppedAtByte;
    } else if (length > 0) {
      break;  // a part of the answer
    } else if (giveUp.hasPassed()) {
      return -ETIMEDOUT;
    } else {
      std::this_thread::sleep_for(kInstrumentPause);
    }
  }
  return static_cast<std::int64_t>(length);
}

int UsbtmcModel::control(unsigned long request, void* argument) {
  if (const int error = begin(); error != 0) return error;
  const int result = configure(request, argument);
  return result == -EBADRQC ? operate(request, argument) : result;
}

int UsbtmcModel::configure(unsigned long request, void* argument) {
  switch (request) {
    case USBTMC_IOCTL_AUTO_ABORT:
      return 0;
    case USBTMC_IOCTL_SET_TIMEOUT: {
      const auto timeoutMs = *static_cast<std::uint32_t*>(argument);
      if (timeoutMs < kShortestTimeoutMs) return -EINVAL;
      timeoutMs_ = timeoutMs;
      return 0;
    }
    case USBTMC_IOCTL_EOM_ENABLE:
      sendsEnd_ = byteAt(argument) != 0;
      return 0;
    case USBTMC_IOCTL_CONFIG_TERMCHAR: {
      const auto stopAt = *static_cast<usbtmc_termchar*>(argument);
      if (stopAt.term_char_enabled != 0 && !stopsAtByte_) return -EINVAL;
      stopAt_ = stopAt.term_char_enabled != 0 ? stopAt.term_char : -1;
      return 0;
    }
    case USBTMC_IOCTL_MSG_IN_ATTR:
      byteAt(argument) = attributes_;
      return 0;
    case USBTMC488_IOCTL_GET_CAPS:
      byteAt(argument) = capabilities_;
      return 0;
    default:
      return -EBADRQC;
  }
}

int UsbtmcModel::operate(unsigned long request, void* argument) {
  switch (request) {
    case USBTMC_IOCTL_CLEAR:
      instrument_->clear();
      return 0;
    case USBTMC488_IOCTL_READ_STB:
      byteAt(argument) = instrument_->serialPoll();
      return 0;
    case USBTMC488_IOCTL_TRIGGER:
      instrument_->trigger();
      return 0;
    case USBTMC488_IOCTL_REN_CONTROL:
      if (!can(USBTMC488_CAPABILITY_SIMPLE)) return -EINVAL;
      instrument_->setControl(byteAt(argument) != 0 ? Control::remote : Control::local);
      return 0;
    case USBTMC488_IOCTL_GOTO_LOCAL:
      if (!can(USBTMC488_CAPABILITY_SIMPLE)) return -EINVAL;
      instrument_->setControl(Control::local);
      return 0;
    case USBTMC488_IOCTL_LOCAL_LOCKOUT:
      if (!can(USBTMC488_CAPABILITY_SIMPLE)) return -EINVAL;
      instrument_->setControl(Control::remoteWithLockout);
      return 0;
    default:
      return -EBADRQC;
  }
}

int UsbtmcModel::pollServiceRequest() {
  if (const int error = begin(); error != 0) return error;
  return instrument_->requestsService() ? 1 : 0;
}

}  // namespace mpf
