// SPDX-License-Identifier: MIT
#include "drivers/gpib/linux_gpib_controller.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/format.h>
#include <stdexcept>
#include <system_error>

#include <mpf/drivers/gpib/linux_gpib.h>

#include "drivers/gpib/command_bytes.h"
#include "drivers/gpib/peeked_bytes.h"

namespace mpf {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

constexpr int kBoards = 16;
constexpr long kBytesOfCall = 64 << 10;

// The time for the commands that end an operation; not counted, because they end a failure, too.
constexpr Nanoseconds kTimeToEnd = 10ms;

// The timeouts of the library: T1ms and those after it.
constexpr int kFirstCode = 5;
constexpr std::array<Nanoseconds, 13> kTimeouts{1ms, 3ms, 10ms, 30ms, 100ms, 300ms, 1s,
                                                3s,  10s, 30s,  100s, 300s,  1000s};

// The shortest timeout of the library that is not before the deadline.
int codeNotBefore(Deadline deadline) {
  const auto* const found = std::ranges::lower_bound(kTimeouts, deadline.left());
  const auto index = std::min<std::ptrdiff_t>(found - kTimeouts.begin(), kTimeouts.size() - 1);
  return kFirstCode + static_cast<int>(index);
}

// The longest timeout of the library that is not after the deadline; the shortest one, when the
// deadline is nearer.
int codeNotAfter(Deadline deadline) {
  const auto* const found = std::ranges::upper_bound(kTimeouts, deadline.left());
  const auto index = std::max<std::ptrdiff_t>(found - kTimeouts.begin() - 1, 0);
  return kFirstCode + static_cast<int>(index);
}

void appendAddress(std::vector<std::uint8_t>& commands, std::uint8_t base,
                   const GpibAddress& address) {
  commands.push_back(base + address.primary);
  if (address.secondary) commands.push_back(gpib_command::kSecondary + *address.secondary);
}

}  // namespace

std::unique_ptr<GpibController> openLinuxGpib(const LinuxGpibOptions& options) {
  if (options.board < 0 || options.board >= kBoards)
    throw std::invalid_argument(
        fmt::format("Linux GPIB board {}: boards have numbers from 0 to 15", options.board));
  return std::make_unique<LinuxGpibController>(options.board, options.library);
}

LinuxGpibController::LinuxGpibController(int board, const std::string& library)
    : board_(board),
      description_(fmt::format("Linux GPIB board {} (/dev/gpib{})", board, board)),
      library_(library) {}

GpibResult LinuxGpibController::write(const GpibAddress& to, Bytes data, bool sendEnd,
                                      Deadline deadline) {
  if (data.empty()) return {};
  Commands commands;
  auto result = addBoard(gpib_command::kTalk, commands);
  if (!result.ok()) return result;
  commands.push_back(gpib_command::kUnlisten);
  appendAddress(commands, gpib_command::kListen, to);
  result = sendCommands(commands, deadline);
  if (result.ok()) result = transmit(data, sendEnd, deadline);
  unaddress(result);
  return result;
}

GpibResult LinuxGpibController::transmit(Bytes data, bool sendEnd, Deadline deadline) {
  library_.setEnd(board_, sendEnd ? 1 : 0);
  library_.setTimeout(board_, codeNotBefore(deadline));
  const int status = library_.write(board_, data.data(), static_cast<long>(data.size()));
  const bool isDone = (status & LibGpib::kError) == 0;
  const auto sent = std::clamp<long>(library_.count(), 0, static_cast<long>(data.size()));
  const auto shown = isDone            ? data
                     : isSystemError() ? Bytes{}
                                       : data.first(static_cast<std::size_t>(sent));
  showPeeked(peek_, shown, {.direction = GpibDirection::sent, .end = isDone && sendEnd});
  return resultOf("write", status);
}

GpibReadResult LinuxGpibController::read(const GpibAddress& from, const GpibReadLimits& limits,
                                         Deadline deadline) {
  GpibReadResult result;
  Commands commands{gpib_command::kUnlisten};
  static_cast<GpibResult&>(result) = addBoard(gpib_command::kListen, commands);
  if (!result.ok()) return result;
  appendAddress(commands, gpib_command::kTalk, from);
  static_cast<GpibResult&>(result) = sendCommands(commands, deadline);
  if (result.ok()) result = receive(limits, deadline);
  unaddress(result);
  return result;
}

GpibReadResult LinuxGpibController::receive(const GpibReadLimits& limits, Deadline deadline) {
  GpibReadResult result;
  const auto stopAt = limits.endOfString;
  library_.setEndOfString(board_, stopAt ? LibGpib::kStopAtByte | *stopAt : 0);
  std::vector<std::uint8_t> bytes(std::min<std::size_t>(limits.maxBytes, kBytesOfCall));
  for (;;) {
    const auto wanted = std::min(bytes.size(), limits.maxBytes - result.data.size());
    library_.setTimeout(board_, codeNotAfter(deadline));
    const int status = library_.read(board_, bytes.data(), static_cast<long>(wanted));
    static_cast<GpibResult&>(result) = resultOf("read", status);
    const auto count = isSystemError() && !result.ok() ? 0 : library_.count();
    const auto length =
        static_cast<std::size_t>(std::clamp<long>(count, 0, static_cast<long>(wanted)));
    const Bytes received(bytes.data(), length);
    result.data.insert(result.data.end(), received.begin(), received.end());
    const bool isString = stopAt && length > 0 && received.back() == *stopAt;
    const bool ended = (status & LibGpib::kEnd) != 0 && length > 0;
    result.sawEnd = ended && !isString;
    showPeeked(peek_, received, {.direction = GpibDirection::received, .end = result.sawEnd});
    const bool isComplete = ended || isString || result.data.size() == limits.maxBytes;
    if (isComplete && result.status == GpibStatus::timeout) static_cast<GpibResult&>(result) = {};
    const bool mayContinue = result.ok() || result.status == GpibStatus::timeout;
    if (isComplete || !mayContinue || deadline.hasPassed()) return result;
  }
}

GpibResult LinuxGpibController::sendCommands(Bytes commands, Deadline deadline) {
  if (deadline.hasPassed())
    return {GpibStatus::timeout, "the deadline had passed before the operation began"};
  library_.setTimeout(board_, codeNotBefore(deadline));
  const int status = library_.command(board_, commands.data(), static_cast<long>(commands.size()));
  auto result = resultOf("send commands", status);
  if (result.ok())
    showPeeked(peek_, commands, {.direction = GpibDirection::sent, .attention = true});
  return result;
}

GpibPollResult LinuxGpibController::serialPoll(const GpibAddress& at, Deadline deadline) {
  GpibPollResult result;
  Commands commands{gpib_command::kUnlisten, gpib_command::kSerialPollEnable};
  static_cast<GpibResult&>(result) = addBoard(gpib_command::kListen, commands);
  if (!result.ok()) return result;
  appendAddress(commands, gpib_command::kTalk, at);
  static_cast<GpibResult&>(result) = sendCommands(commands, deadline);
  if (result.ok()) {
    const auto answer = receive({.maxBytes = 1}, deadline);
    static_cast<GpibResult&>(result) = answer;
    if (!answer.data.empty()) result.statusByte = answer.data.front();
  }
  constexpr std::array<std::uint8_t, 1> kDisable{gpib_command::kSerialPollDisable};
  static_cast<void>(sendCommands(kDisable, Deadline::after(kTimeToEnd)));
  unaddress(result);
  return result;
}

GpibResult LinuxGpibController::clearAll(Deadline deadline) {
  constexpr std::array<std::uint8_t, 1> kCommands{gpib_command::kDeviceClear};
  return sendCommands(kCommands, deadline);
}

GpibResult LinuxGpibController::clear(const GpibAddress& at, Deadline deadline) {
  return addressed({&at, 1}, gpib_command::kSelectedDeviceClear, deadline);
}

GpibResult LinuxGpibController::trigger(std::span<const GpibAddress> at, Deadline deadline) {
  return addressed(at, gpib_command::kGroupExecuteTrigger, deadline);
}

GpibResult LinuxGpibController::localLockout(Deadline deadline) {
  constexpr std::array<std::uint8_t, 1> kCommands{gpib_command::kLocalLockout};
  return sendCommands(kCommands, deadline);
}

GpibResult LinuxGpibController::goToLocal(const GpibAddress& at, Deadline deadline) {
  return addressed({&at, 1}, gpib_command::kGoToLocal, deadline);
}

GpibResult LinuxGpibController::addressed(std::span<const GpibAddress> at, std::uint8_t command,
                                          Deadline deadline) {
  Commands commands{gpib_command::kUnlisten};
  for (const auto& address : at) appendAddress(commands, gpib_command::kListen, address);
  commands.push_back(command);
  auto result = sendCommands(commands, deadline);
  unaddress(result);
  return result;
}

GpibResult LinuxGpibController::interfaceClear(Deadline /*deadline*/) {
  return resultOf("IFC", library_.interfaceClear(board_));
}

GpibResult LinuxGpibController::remoteEnable(bool on, Deadline /*deadline*/) {
  return resultOf("set REN", library_.remoteEnable(board_, on ? 1 : 0));
}

std::optional<bool> LinuxGpibController::requestsService(Deadline /*deadline*/) {
  short lines = 0;
  const bool isKnown = (library_.lines(board_, &lines) & LibGpib::kError) == 0 &&
                       (lines & LibGpib::kKnowsServiceRequest) != 0;
  return isKnown ? std::optional((lines & LibGpib::kServiceRequest) != 0) : std::nullopt;
}

GpibResult LinuxGpibController::addBoard(std::uint8_t base, Commands& commands) const {
  int own = 0;
  const int status = library_.ask(board_, LibGpib::kOwnPrimaryAddress, &own);
  commands.push_back(static_cast<std::uint8_t>(base + own));
  return resultOf("find the address of the board", status);
}

void LinuxGpibController::unaddress(const GpibResult& result) {
  constexpr std::array<std::uint8_t, 2> kCommands{gpib_command::kUntalk, gpib_command::kUnlisten};
  const auto ended = sendCommands(kCommands, Deadline::after(kTimeToEnd));
  if (!ended.ok() && !result.ok()) static_cast<void>(library_.interfaceClear(board_));
}

bool LinuxGpibController::isSystemError() const {
  return library_.error() == static_cast<int>(LibGpib::Error::systemCall);
}

GpibResult LinuxGpibController::resultOf(std::string_view what, int status) const {
  if ((status & LibGpib::kError) == 0) return {};
  const auto error = library_.error();
  const auto failed = [&](GpibStatus kind, std::string_view why) {
    return GpibResult{kind, fmt::format("{}: {}: {}", description_, what, why)};
  };
  switch (static_cast<LibGpib::Error>(error)) {
    case LibGpib::Error::systemCall:
      return failed(
          GpibStatus::failure,
          fmt::format("{}; check that the driver is loaded and this user may open it",
                      std::generic_category().message(static_cast<int>(library_.count()))));
    case LibGpib::Error::notController:
      return failed(GpibStatus::failure, "the board is not in charge of the bus; send IFC");
    case LibGpib::Error::noListener:
      return failed(GpibStatus::noListener,
                    "no instrument accepted the bytes; check the address and that it is on");
    case LibGpib::Error::notSystemController:
      return failed(GpibStatus::failure,
                    "the board is not the system controller; set master = yes in gpib.conf");
    case LibGpib::Error::aborted:
      return failed(GpibStatus::timeout, "no answer in time");
    case LibGpib::Error::noBoard:
      return failed(GpibStatus::failure,
                    "no such board; load the driver of the board and run gpib_config");
  }
  return failed(GpibStatus::failure, fmt::format("error {} of libgpib", error));
}

}  // namespace mpf
