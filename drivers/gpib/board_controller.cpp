// SPDX-License-Identifier: MIT
#include "drivers/gpib/board_controller.h"

#include <array>
#include <fmt/format.h>
#include <utility>
#include <vector>

#include "drivers/gpib/command_bytes.h"

namespace mpf {
namespace {

using gpib_command::Command;

constexpr std::array<std::uint8_t, 2> kUnaddress{gpib_command::kUntalk, gpib_command::kUnlisten};
constexpr std::array<std::uint8_t, 3> kEndPoll{gpib_command::kSerialPollDisable,
                                               gpib_command::kUntalk, gpib_command::kUnlisten};

// The commands that begin an operation.
class Opening {
 public:
  Opening() : bytes_(kUnaddress.begin(), kUnaddress.end()) {}
  Opening& add(std::uint8_t command) {
    bytes_.push_back(command);
    return *this;
  }
  Opening& add(Command base, const GpibAddress& address) {
    add(base + address.primary);
    return address.secondary ? add(gpib_command::kSecondary + *address.secondary) : *this;
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

// Names the instrument in the reason of a failure.
template <class Result>
Result about(const GpibAddress& address, Result result) {
  if (!result.ok())
    result.reason = fmt::format("instrument {}: {}", toString(address), result.reason);
  return result;
}

template <class Result>
Result failed(GpibResult&& problem) {
  Result result;
  static_cast<GpibResult&>(result) = std::move(problem);
  return result;
}

}  // namespace

GpibResult GpibBoardController::check(const GpibAddress& address) const {
  if (!address.isValid())
    return {GpibStatus::failure,
            fmt::format("{} is not a GPIB address: use 0 to 30", toString(address))};
  if (address.primary == own_)
    return {GpibStatus::failure,
            fmt::format("address {} is that of the controller: give the instrument another one",
                        toString(address))};
  return {};
}

// Ends an operation: the bus has no talker and no listeners afterwards. If that fails, the
// instruments have sent or received everything nevertheless, and the result stays.
template <class Result>
Result GpibBoardController::close(Result result, Bytes closing, Deadline deadline) {
  if (!result.ok() || !command(closing, deadline).ok()) recover(closing);
  return result;
}

GpibResult GpibBoardController::write(const GpibAddress& to, Bytes data, bool sendEnd,
                                      Deadline deadline) {
  if (auto problem = check(to); !problem.ok()) return problem;
  Opening opening;
  if (kind_ == OwnAddress::sent) opening.add(gpib_command::kTalk + own_);
  auto result = command(opening.add(gpib_command::kListen, to).bytes(), deadline);
  if (result.ok() && !data.empty()) result = send(data, sendEnd, deadline);
  return about(to, close(std::move(result), kUnaddress, deadline));
}

GpibReadResult GpibBoardController::read(const GpibAddress& from, const GpibReadLimits& limits,
                                         Deadline deadline) {
  if (auto problem = check(from); !problem.ok()) return failed<GpibReadResult>(std::move(problem));
  if (limits.maxBytes == 0)
    return failed<GpibReadResult>(
        {GpibStatus::failure, "a read of 0 bytes: the limit must be at least 1"});
  Opening opening;
  opening.add(gpib_command::kTalk, from);
  if (kind_ == OwnAddress::sent) opening.add(gpib_command::kListen + own_);
  auto addressed = command(opening.bytes(), deadline);
  auto result =
      addressed.ok() ? receive(limits, deadline) : failed<GpibReadResult>(std::move(addressed));
  return about(from, close(std::move(result), kUnaddress, deadline));
}

GpibPollResult GpibBoardController::serialPoll(const GpibAddress& at, Deadline deadline) {
  if (auto problem = check(at); !problem.ok()) return failed<GpibPollResult>(std::move(problem));
  Opening opening;
  opening.add(gpib_command::kSerialPollEnable).add(gpib_command::kTalk, at);
  if (kind_ == OwnAddress::sent) opening.add(gpib_command::kListen + own_);
  GpibPollResult result;
  static_cast<GpibResult&>(result) = command(opening.bytes(), deadline);
  if (result.ok()) {
    auto answer = receive({.maxBytes = 1}, deadline);
    if (answer.ok()) result.statusByte = answer.data.front();
    static_cast<GpibResult&>(result) = std::move(answer);
  }
  return about(at, close(std::move(result), kEndPoll, deadline));
}

GpibResult GpibBoardController::sendCommands(Bytes commands, Deadline deadline) {
  auto result = command(commands, deadline);
  if (!result.ok()) recover(kUnaddress);
  return result;
}

GpibResult GpibBoardController::clearAll(Deadline deadline) {
  return sendCommands(std::array<std::uint8_t, 1>{gpib_command::kDeviceClear}, deadline);
}

GpibResult GpibBoardController::localLockout(Deadline deadline) {
  return sendCommands(std::array<std::uint8_t, 1>{gpib_command::kLocalLockout}, deadline);
}

GpibResult GpibBoardController::clear(const GpibAddress& at, Deadline deadline) {
  return about(at, sendToListeners({&at, 1}, gpib_command::kSelectedDeviceClear, deadline));
}

GpibResult GpibBoardController::goToLocal(const GpibAddress& at, Deadline deadline) {
  return about(at, sendToListeners({&at, 1}, gpib_command::kGoToLocal, deadline));
}

GpibResult GpibBoardController::trigger(std::span<const GpibAddress> at, Deadline deadline) {
  return sendToListeners(at, gpib_command::kGroupExecuteTrigger, deadline);
}

GpibResult GpibBoardController::sendToListeners(std::span<const GpibAddress> at,
                                                std::uint8_t commandByte, Deadline deadline) {
  Opening opening;
  for (const auto& address : at) {
    if (auto problem = check(address); !problem.ok()) return problem;
    opening.add(gpib_command::kListen, address);
  }
  return close(command(opening.add(commandByte).bytes(), deadline), kUnaddress, deadline);
}

}  // namespace mpf
