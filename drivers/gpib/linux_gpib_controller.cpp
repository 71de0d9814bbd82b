// SPDX-License-Identifier: MIT
#include "drivers/gpib/linux_gpib_controller.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/format.h>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include <mpf/drivers/gpib/linux_gpib.h>

namespace mpf {
namespace {

constexpr int kBoards = 16;
constexpr std::size_t kBytesOfCall = 64 << 10;

// The time for the commands that end an operation; not counted, because they end a failure, too.
constexpr std::chrono::milliseconds kTimeToEnd{10};

// The timeouts of the library: T1ms and those after it.
constexpr int kFirstCode = 5;
constexpr std::array<int, 13> kTimeoutsMs{1,    3,      10,     30,      100,     300,      1000,
                                          3000, 10'000, 30'000, 100'000, 300'000, 1'000'000};
constexpr auto kToNanoseconds = [](int timeoutMs) {
  return Nanoseconds(std::chrono::milliseconds(timeoutMs));
};

// The shortest timeout of the library that is not before the deadline.
int codeNotBefore(Deadline deadline) {
  const auto* const found =
      std::ranges::lower_bound(kTimeoutsMs, deadline.left(), {}, kToNanoseconds);
  const auto index = std::min<std::ptrdiff_t>(found - kTimeoutsMs.begin(), kTimeoutsMs.size() - 1);
  return kFirstCode + static_cast<int>(index);
}

// The longest timeout of the library that is not after the deadline; the shortest one, when the
// deadline is nearer.
int codeNotAfter(Deadline deadline) {
  const auto* const found =
      std::ranges::upper_bound(kTimeoutsMs, deadline.left(), {}, kToNanoseconds);
  const auto index = std::max<std::ptrdiff_t>(found - kTimeoutsMs.begin() - 1, 0);
  return kFirstCode + static_cast<int>(index);
}

}  // namespace

std::unique_ptr<GpibController> openLinuxGpib(const LinuxGpibOptions& options) {
  if (options.board < 0 || options.board >= kBoards)
    throw std::invalid_argument(
        fmt::format("Linux GPIB board {}: boards have numbers from 0 to 15", options.board));
  LibGpib library(options.library);
  int own = 0;  // stays 0, the usual address, while the board is absent
  library.ask(options.board, LibGpib::kOwnPrimaryAddress, &own);
  return std::make_unique<LinuxGpibController>(options.board, std::move(library),
                                               static_cast<std::uint8_t>(own));
}

LinuxGpibController::LinuxGpibController(int board, LibGpib library, std::uint8_t own)
    : GpibBoardController(OwnAddress::sent, own),
      board_(board),
      description_(fmt::format("Linux GPIB board {} (/dev/gpib{})", board, board)),
      library_(std::move(library)) {}

GpibResult LinuxGpibController::command(Bytes commands, Deadline deadline) {
  if (deadline.hasPassed())
    return {GpibStatus::timeout, "the deadline had passed before the operation began"};
  library_.setTimeout(board_, codeNotBefore(deadline));
  const int status = library_.command(board_, commands.data(), static_cast<long>(commands.size()));
  peek_.show(commands.first(transferred(status, commands.size())),
             {.attention = true, .direction = GpibDirection::sent});
  return resultOf("send commands", status);
}

GpibResult LinuxGpibController::send(Bytes data, bool sendEnd, Deadline deadline) {
  library_.setEnd(board_, sendEnd ? 1 : 0);
  library_.setTimeout(board_, codeNotBefore(deadline));
  const int status = library_.write(board_, data.data(), static_cast<long>(data.size()));
  const auto sent = data.first(transferred(status, data.size()));
  peek_.show(sent,
             {.end = sendEnd && sent.size() == data.size(), .direction = GpibDirection::sent});
  return resultOf("write", status);
}

GpibReadResult LinuxGpibController::receive(const GpibReadLimits& limits, Deadline deadline) {
  GpibReadResult result;
  const auto stopAt = limits.endOfString;
  library_.setEndOfString(board_, stopAt ? LibGpib::kStopAtByte | *stopAt : 0);
  std::vector<std::uint8_t> bytes(std::min(limits.maxBytes, kBytesOfCall));
  for (;;) {
    const auto wanted = std::min(bytes.size(), limits.maxBytes - result.data.size());
    library_.setTimeout(board_, codeNotAfter(deadline));
    const int status = library_.read(board_, bytes.data(), static_cast<long>(wanted));
    const auto received = Bytes(bytes).first(transferred(status, wanted));
    const bool isString = stopAt && !received.empty() && received.back() == *stopAt;
    const bool ended = (status & LibGpib::kEnd) != 0 && !received.empty();
    result.data.insert(result.data.end(), received.begin(), received.end());
    result.sawEnd = ended && !isString;
    peek_.show(received, {.end = result.sawEnd, .direction = GpibDirection::received});
    if (ended || isString || result.data.size() == limits.maxBytes) return result;
    const auto problem = resultOf("read", status);
    if ((problem.ok() || problem.status == GpibStatus::timeout) && !deadline.hasPassed()) continue;
    static_cast<GpibResult&>(result) = problem;
    if (problem.ok()) result.status = GpibStatus::timeout;
    return result;
  }
}

void LinuxGpibController::recover(Bytes closing) {
  if (!command(closing, Deadline::after(kTimeToEnd)).ok())
    static_cast<void>(library_.interfaceClear(board_));
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

std::size_t LinuxGpibController::transferred(int status, std::size_t wanted) const {
  // After other errors, count() means something else.
  const bool isCount = (status & LibGpib::kError) == 0 ||
                       library_.error() == static_cast<int>(LibGpib::Error::aborted);
  if (!isCount) return 0;
  return static_cast<std::size_t>(std::clamp<long>(library_.count(), 0, static_cast<long>(wanted)));
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
      return failed(GpibStatus::failure,
                    "the board is not the controller in charge (CIC); send IFC");
    case LibGpib::Error::noListener:
      return failed(GpibStatus::noListener,
                    "no instrument accepted the bytes; check the address and that it is on");
    case LibGpib::Error::notAddressed:
      return failed(GpibStatus::failure,
                    "the board has another address than when it was opened; open it again");
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
