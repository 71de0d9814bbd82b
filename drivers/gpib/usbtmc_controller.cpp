// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_controller.h"

#include <linux/usb/tmc.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <system_error>
#include <utility>

#include <mpf/drivers/gpib/usbtmc.h>

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kShortestTimeout{100};  // of the kernel's driver
constexpr std::chrono::hours kLongestTimeout{24};
constexpr std::size_t kMostBytesOfRead = 64 << 10;

std::string systemReason(std::int64_t result) {
  return std::generic_category().message(static_cast<int>(-result));
}

std::string adviceOn(std::int64_t result) {
  switch (-result) {
    case ENOENT:
      return "; plug the instrument in, and load the kernel module usbtmc";
    case EACCES:
      return "; allow this user to open the device, with a rule of udev";
    case EBADRQC:
      return "; the kernel's driver usbtmc is older than Linux 4.20";
    case ENODEV:
    case ESHUTDOWN:
      return "; the next operation opens the device again";
    default:
      return {};
  }
}

}  // namespace

std::unique_ptr<GpibController> openUsbtmc(const UsbtmcOptions& options) {
  return std::make_unique<UsbtmcController>(options.device, usbtmcDeviceFile(options.device));
}

UsbtmcController::UsbtmcController(const std::string& device, std::unique_ptr<UsbtmcFile> file)
    : description_(fmt::format("USB instrument at {}", device)), file_(std::move(file)) {}

GpibResult UsbtmcController::prepare(Deadline deadline) {
  if (deadline.hasPassed())
    return {GpibStatus::timeout, "the deadline had passed before the operation began"};
  if (state_ == State::closed) {
    if (auto result = open(); !result.ok()) return result;
  }
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(
      std::min<Nanoseconds>(deadline.left(), kLongestTimeout));
  auto timeoutMs = static_cast<std::uint32_t>(std::max(left, kShortestTimeout).count());
  const int result = file_->control(USBTMC_IOCTL_SET_TIMEOUT, &timeoutMs);
  return result < 0 ? failed("set the timeout", result) : GpibResult{};
}

GpibResult UsbtmcController::open() {
  if (const int result = file_->open(); result < 0) return failed("open", result);
  state_ = State::open;
  std::uint8_t on = 1;
  int result = file_->control(USBTMC_IOCTL_AUTO_ABORT, &on);
  if (result >= 0) result = file_->control(USBTMC488_IOCTL_GET_CAPS, &capabilities_);
  if (result >= 0) return {};
  auto problem = failed("set up", result);
  file_->close();
  state_ = State::closed;
  return problem;
}

GpibResult UsbtmcController::write(const GpibAddress& /*to*/, Bytes data, bool sendEnd,
                                   Deadline deadline) {
  static_cast<void>(received_.takeAll());
  if (data.empty()) return {};
  if (auto result = prepare(deadline); !result.ok()) return result;
  std::uint8_t end = sendEnd ? 1 : 0;
  if (const int result = file_->control(USBTMC_IOCTL_EOM_ENABLE, &end); result < 0)
    return failed("write", result);
  const auto sent = file_->write(data);
  if (sent < 0) return failed("write", sent);
  if (static_cast<std::size_t>(sent) < data.size())
    return {GpibStatus::failure, fmt::format("{}: write: the instrument accepted {} of {} bytes",
                                             description_, sent, data.size())};
  peek_.show(data, {.end = sendEnd, .direction = GpibDirection::sent});
  return {};
}

GpibReadResult UsbtmcController::read(const GpibAddress& /*from*/, const GpibReadLimits& limits,
                                      Deadline deadline) {
  GpibReadResult result;
  for (;;) {
    if (auto complete = received_.take(limits)) return std::move(*complete);
    if (!result.ok()) break;
    static_cast<GpibResult&>(result) = prepare(deadline);
    if (result.ok()) static_cast<GpibResult&>(result) = readOnce(limits);
  }
  result.data = received_.takeAll();
  return result;
}

GpibResult UsbtmcController::readOnce(const GpibReadLimits& limits) {
  usbtmc_termchar stopAt{limits.endOfString.value_or(0), limits.endOfString ? __u8{1} : __u8{0}};
  int result = file_->control(USBTMC_IOCTL_CONFIG_TERMCHAR, &stopAt);
  // The instrument cannot stop at a byte: received_ divides its message.
  if (result < 0 && result != -EINVAL) return failed("read", result);
  std::vector<std::uint8_t> bytes(std::min(limits.maxBytes, kMostBytesOfRead));
  const auto length = file_->read(bytes);
  if (length < 0) return failed("read", length);
  bytes.resize(static_cast<std::size_t>(length));
  std::uint8_t attributes = 0;
  result = file_->control(USBTMC_IOCTL_MSG_IN_ATTR, &attributes);
  if (result < 0) return failed("read", result);
  const bool end = (attributes & kUsbtmcEndOfMessage) != 0;
  received_.append(bytes, end);
  peek_.show(bytes, {.end = end, .direction = GpibDirection::received});
  return {};
}

GpibResult UsbtmcController::sendCommands(Bytes /*commands*/, Deadline /*deadline*/) {
  return unsupported("commands of the bus");
}

GpibPollResult UsbtmcController::serialPoll(const GpibAddress& /*at*/, Deadline deadline) {
  GpibPollResult result;
  static_cast<GpibResult&>(result) =
      control("serial poll", USBTMC488_IOCTL_READ_STB, &result.statusByte, deadline);
  return result;
}

GpibResult UsbtmcController::clearAll(Deadline deadline) {
  static_cast<void>(received_.takeAll());
  return control("clear", USBTMC_IOCTL_CLEAR, nullptr, deadline);
}

GpibResult UsbtmcController::clear(const GpibAddress& /*at*/, Deadline deadline) {
  return clearAll(deadline);
}

GpibResult UsbtmcController::trigger(std::span<const GpibAddress> /*at*/, Deadline deadline) {
  return controlIf(USBTMC488_CAPABILITY_TRIGGER, "trigger", USBTMC488_IOCTL_TRIGGER, deadline);
}

GpibResult UsbtmcController::interfaceClear(Deadline deadline) {
  static_cast<void>(received_.takeAll());
  return control("check the presence", USBTMC488_IOCTL_GET_CAPS, &capabilities_, deadline);
}

// An instrument without REN control is always ready for remote control.
GpibResult UsbtmcController::remoteEnable(bool on, Deadline deadline) {
  if (auto result = prepare(deadline); !result.ok()) return result;
  if ((capabilities_ & USBTMC488_CAPABILITY_REN_CONTROL) == 0)
    return on ? GpibResult{} : unsupported("REN off");
  std::uint8_t value = on ? 1 : 0;
  return control("set REN", USBTMC488_IOCTL_REN_CONTROL, &value, deadline);
}

GpibResult UsbtmcController::localLockout(Deadline deadline) {
  return controlIf(USBTMC488_CAPABILITY_LOCAL_LOCKOUT, "local lockout",
                   USBTMC488_IOCTL_LOCAL_LOCKOUT, deadline);
}

GpibResult UsbtmcController::goToLocal(const GpibAddress& /*at*/, Deadline deadline) {
  return controlIf(USBTMC488_CAPABILITY_GOTO_LOCAL, "go to local", USBTMC488_IOCTL_GOTO_LOCAL,
                   deadline);
}

std::optional<bool> UsbtmcController::requestsService(Deadline deadline) {
  if (!prepare(deadline).ok()) return std::nullopt;
  const int result = file_->pollServiceRequest();
  if (result >= 0) return result > 0;
  static_cast<void>(failed("poll", result));
  return std::nullopt;
}

GpibResult UsbtmcController::control(std::string_view what, unsigned long request, void* argument,
                                     Deadline deadline) {
  if (auto result = prepare(deadline); !result.ok()) return result;
  const int result = file_->control(request, argument);
  return result < 0 ? failed(what, result) : GpibResult{};
}

GpibResult UsbtmcController::controlIf(std::uint8_t capability, std::string_view what,
                                       unsigned long request, Deadline deadline) {
  if (auto result = prepare(deadline); !result.ok()) return result;
  if ((capabilities_ & capability) == 0) return unsupported(what);
  return control(what, request, nullptr, deadline);
}

GpibResult UsbtmcController::failed(std::string_view what, std::int64_t result) {
  if (result == -ETIMEDOUT)
    return {GpibStatus::timeout,
            fmt::format("{}: {}: the instrument did not answer in time", description_, what)};
  if (result == -ENODEV || result == -ESHUTDOWN) {
    file_->close();
    state_ = State::closed;
  }
  return {GpibStatus::failure,
          fmt::format("{}: {}: {}{}", description_, what, systemReason(result), adviceOn(result))};
}

GpibResult UsbtmcController::unsupported(std::string_view what) const {
  return {GpibStatus::unsupported,
          fmt::format("{}: {}: not supported by this instrument over USB", description_, what)};
}

}  // namespace mpf
