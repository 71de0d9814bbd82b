// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_controller.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include <mpf/drivers/gpib/prologix.h>
#include <mpf/drivers/serial/posix_terminal.h>
#include <mpf/drivers/serial/tcp_serial_port.h>

#include "base/number.h"
#include "base/printable.h"
#include "drivers/gpib/prologix_commands.h"

namespace mpf {
namespace {

using prologix::addressText;

std::chrono::milliseconds silenceFor(Deadline deadline) {
  const auto wanted =
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline.left() / 4 * 3);
  return std::clamp(wanted, prologix::kShortestSilence, prologix::kLongestSilence);
}

std::string selection(const GpibAddress& address, std::chrono::milliseconds silence) {
  return fmt::format("++addr {}\n++read_tmo_ms {}\n", addressText(address), silence.count());
}

std::string_view textOf(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The number in the first line of an answer.
std::optional<int> numberOf(std::string_view line) {
  const auto number = tryTakeNumber<int>(line);
  return line == "\r\n" ? number : std::nullopt;
}

PrologixLink::OpenPort portAt(const std::string& address) {
  if (address.starts_with('/'))
    return [address] { return openPosixTerminal({.device = address, .waitForDevice = true}); };
  return [parsed = TcpAddress::parse(address)] {
    return openTcpSerialPort({.address = parsed, .waitForServer = true});
  };
}

}  // namespace

std::unique_ptr<GpibController> openPrologix(const PrologixOptions& options) {
  return std::make_unique<PrologixController>(options.address);
}

PrologixController::PrologixController(const std::string& address,
                                       std::chrono::milliseconds patience)
    : link_(fmt::format("Prologix at {}", address), portAt(address), patience) {}

GpibResult PrologixController::write(const GpibAddress& to, Bytes data, bool sendEnd,
                                     Deadline deadline) {
  received_.erase(to);
  if (data.empty()) return {};
  auto lines = selection(to, silenceFor(deadline));
  prologix::appendData(lines, data, sendEnd);
  auto result = ask(lines, deadline).result;
  if (result.ok()) peek_.show(data, {.end = sendEnd, .direction = GpibDirection::sent});
  return result;
}

GpibReadResult PrologixController::read(const GpibAddress& from, const GpibReadLimits& limits,
                                        Deadline deadline) {
  auto& received = received_[from];
  GpibReadResult result;
  // The controller works, so it is the instrument that is silent.
  bool isInstrumentSilent = false;
  for (;;) {
    if (auto complete = received.take(limits)) return std::move(*complete);
    if (!result.ok()) break;
    auto answer = readOnce(from, limits, deadline);
    // Text, which has an end-of-string byte, does not contain marks.
    const bool end = answer.isComplete && !answer.bytes.empty() &&
                     answer.bytes.back() == answer.mark &&
                     (limits.endOfString || !answer.endsWithSilence);
    if (end) answer.bytes.pop_back();
    received.append(answer.bytes, end);
    peek_.show(answer.bytes, {.end = end, .direction = GpibDirection::received});
    isInstrumentSilent |= answer.isComplete;
    static_cast<GpibResult&>(result) = std::move(answer.result);
    if (result.ok() && deadline.hasPassed()) result.status = GpibStatus::timeout;
  }
  if (result.status == GpibStatus::timeout && isInstrumentSilent)
    result.reason = fmt::format("{}: the instrument at address {} sent no complete answer",
                                description(), toString(from));
  result.data = received.takeAll();
  return result;
}

PrologixLink::Answer PrologixController::readOnce(const GpibAddress& from,
                                                  const GpibReadLimits& limits, Deadline deadline) {
  const auto silence = silenceFor(deadline);
  auto lines = selection(from, silence);
  if (limits.endOfString) {
    lines += fmt::format("++read {}\n", *limits.endOfString);
  } else {
    lines += "++read eoi\n";
  }
  return link_.exchange({.commands = std::move(lines),
                         .deadline = deadline,
                         .silence = silence,
                         .otherMarkThan = limits.endOfString});
}

GpibResult PrologixController::sendCommands(Bytes /*commands*/, Deadline /*deadline*/) {
  return unsupported("it sends no command bytes; use the operations of GpibBus");
}

GpibPollResult PrologixController::serialPoll(const GpibAddress& at, Deadline deadline) {
  GpibPollResult result;
  const auto lines =
      fmt::format("{}++spoll {}\n", selection(at, silenceFor(deadline)), addressText(at));
  const auto answer = ask(lines, deadline);
  static_cast<GpibResult&>(result) = answer.result;
  if (!result.ok()) return result;
  const auto number = numberOf(textOf(answer.bytes));
  if (number && *number >= 0 && *number <= 255) {
    result.statusByte = static_cast<std::uint8_t>(*number);
    return result;
  }
  result.status = answer.bytes.empty() ? GpibStatus::timeout : GpibStatus::failure;
  result.reason =
      answer.bytes.empty()
          ? fmt::format("{}: the instrument at address {} sent no status byte; check that it is on",
                        description(), toString(at))
          : fmt::format("{} answers \"{}\" to ++spoll, which is not a status byte", description(),
                        printable(textOf(answer.bytes)));
  return result;
}

GpibResult PrologixController::clearAll(Deadline /*deadline*/) {
  return unsupported("it cannot clear all instruments at once; clear each of them");
}

GpibResult PrologixController::clear(const GpibAddress& at, Deadline deadline) {
  received_.erase(at);
  return ask(fmt::format("++addr {}\n++clr\n", addressText(at)), deadline).result;
}

GpibResult PrologixController::trigger(std::span<const GpibAddress> at, Deadline deadline) {
  if (at.size() > prologix::kMostTriggered)
    return unsupported(fmt::format("it triggers {} instruments at most", prologix::kMostTriggered));
  std::string line = "++trg";
  for (const auto& address : at) line.append(" ").append(addressText(address));
  return ask(line.append("\n"), deadline).result;
}

GpibResult PrologixController::interfaceClear(Deadline deadline) {
  received_.clear();
  return ask("++ifc\n", deadline).result;
}

// A controller without ++ren holds REN all the time.
GpibResult PrologixController::remoteEnable(bool on, Deadline deadline) {
  const auto answer = ask(on ? "++ren 1\n" : "++ren 0\n", deadline);
  if (!answer.result.ok() || answer.bytes.empty() || on) return answer.result;
  return unsupported("this version has no ++ren and holds the REN line all the time");
}

GpibResult PrologixController::localLockout(Deadline deadline) {
  return ask("++llo\n", deadline).result;
}

GpibResult PrologixController::goToLocal(const GpibAddress& at, Deadline deadline) {
  return ask(fmt::format("++addr {}\n++loc\n", addressText(at)), deadline).result;
}

std::optional<bool> PrologixController::requestsService(Deadline deadline) {
  const auto answer = ask("++srq\n", deadline);
  if (!answer.result.ok()) return std::nullopt;
  const auto number = numberOf(textOf(answer.bytes));
  return number ? std::optional(*number != 0) : std::nullopt;
}

PrologixLink::Answer PrologixController::ask(std::string_view commands, Deadline deadline) {
  return link_.exchange({.commands = std::string(commands), .deadline = deadline});
}

GpibResult PrologixController::unsupported(std::string_view why) const {
  return {GpibStatus::unsupported, fmt::format("{}: {}", description(), why)};
}

}  // namespace mpf
