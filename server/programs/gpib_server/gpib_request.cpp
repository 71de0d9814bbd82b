// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/gpib_request.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <optional>
#include <string_view>

#include <mpf/gpib_commands.h>

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): most constants of <mpf/gpib_commands.h>
using namespace gpib;

constexpr std::int32_t kOptions = cmdTimeoutMilliseconds | cmdWithoutEnd;
constexpr std::array<std::string_view, 17> kNames{
    "?",       "read",    "write",        "write-read",    "serial poll",   "clear",
    "trigger", "IFC",     "REN",          "local lockout", "go to local",   "commands",
    "lease",   "unlease", "lease holder", "subscription",  "unsubscription"};

enum class Addressing { none, one, oneOrAll, list };

Addressing addressingOf(std::int32_t command) noexcept {
  switch (command) {
    case cmdRead:
    case cmdWrite:
    case cmdWriteRead:
    case cmdSerialPoll:
    case cmdGoToLocal:
    case cmdSubscribe:
      return Addressing::one;
    case cmdClear:
    case cmdUnsubscribe:
      return Addressing::oneOrAll;
    case cmdTrigger:
      return Addressing::list;
    default:
      return Addressing::none;
  }
}

constexpr std::size_t kLongestName = 80;  // of the holder of a lease

std::chrono::milliseconds timeoutOf(const Char8Array& fields, const GpibLimits& limits) {
  if (fields.timeout <= 0) return std::min(limits.timeout, limits.maxTimeout);
  const bool isInMilliseconds = (fields.cmd & cmdTimeoutMilliseconds) != 0;
  const auto asked = isInMilliseconds ? std::chrono::milliseconds(fields.timeout)
                                      : std::chrono::seconds(fields.timeout);
  return std::min<std::chrono::milliseconds>(asked, limits.maxTimeout);
}

// The further addresses of a trigger; nullopt when they are invalid.
std::optional<std::vector<GpibAddress>> addressesIn(std::span<const std::uint8_t> bytes) {
  if (bytes.size() % 2 != 0) return std::nullopt;
  std::vector<GpibAddress> addresses;
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    GpibAddress address{bytes[i]};
    if (bytes[i + 1] != noSecondaryAddress) address.secondary = bytes[i + 1];
    if (!address.isValid()) return std::nullopt;
    addresses.push_back(address);
  }
  return addresses;
}

// Fills in the addresses. Returns why they are invalid.
std::string readAddresses(const Char8Array& fields, GpibRequest& request) {
  const auto addressing = addressingOf(request.command);
  if (addressing == Addressing::none) return {};
  if (addressing == Addressing::oneOrAll && fields.address == allInstruments) return {};
  const auto address = GpibAddress::fromNumber(fields.address);
  if (!address)
    return fmt::format(
        "address {} is not that of an instrument: use 0 to 30, or 100 * primary + secondary",
        fields.address);
  request.addresses.push_back(*address);
  if (addressing != Addressing::list) return {};
  const auto more = addressesIn(request.data);
  if (!more) return "the further addresses of a trigger are not pairs of bytes from 0 to 30";
  request.addresses.insert(request.addresses.end(), more->begin(), more->end());
  return {};
}

// Fills in the meaning of `extra` and of the end of string. Returns why they are invalid.
std::string readLimits(const Char8Array& fields, const GpibLimits& limits, GpibRequest& request) {
  if (request.command == cmdLease) {
    if (fields.extra < 1) return fmt::format("a lease of {} ms: use 1 or more", fields.extra);
    request.lease = std::min<std::chrono::milliseconds>(std::chrono::milliseconds(fields.extra),
                                                        limits.maxLease);
  }
  if (request.command == cmdRemoteEnable && fields.extra != 0 && fields.extra != 1)
    return fmt::format("remote enable with extra {}: use 1 (on) or 0 (off)", fields.extra);
  if (request.command == cmdLease && request.data.size() > kLongestName)
    return fmt::format("a holder with a name of {} bytes: use at most {}", request.data.size(),
                       kLongestName);
  if (request.command == cmdSubscribe && !request.data.empty())
    return fmt::format("a subscription with a value of {} bytes: use none", request.data.size());
  if (request.command != cmdRead && request.command != cmdWriteRead) return {};
  if (fields.eomLen < 0 || fields.eomLen > static_cast<std::int32_t>(fields.eomString.size()))
    return fmt::format("eomLen {}: use 0 to {}", fields.eomLen, fields.eomString.size());
  if (fields.extra < 0) return fmt::format("a read of {} bytes: use 0 or more", fields.extra);
  const auto asked = static_cast<std::size_t>(fields.extra);
  request.isCountRequested = asked != 0 && asked <= limits.bufferBytes;
  request.limits.maxBytes = request.isCountRequested ? asked : limits.bufferBytes;
  if (const auto eom = fields.eom(); !eom.empty())
    request.limits.endOfString = static_cast<std::uint8_t>(eom.back());
  return {};
}

std::string readCommand(const Char8Array& fields, GpibRequest& request) {
  request.command = fields.cmd & cmdCommandMask;
  request.sendEnd = (fields.cmd & cmdWithoutEnd) == 0;
  const bool isKnown = request.command >= cmdRead && request.command <= cmdUnsubscribe &&
                       (fields.cmd & ~(cmdCommandMask | kOptions)) == 0;
  if (!isKnown)
    return fmt::format(
        "cmd {:#x} is not a command, or has an unknown option: see <mpf/gpib_commands.h>",
        static_cast<std::uint32_t>(fields.cmd));
  if (fields.timeout < 0) return fmt::format("timeout {}: use 0 or more", fields.timeout);
  if (!request.sendEnd && request.command != cmdWrite)
    return fmt::format("a {} without END: the option is for writes",
                       kNames.at(static_cast<std::size_t>(request.command)));
  return {};
}

}  // namespace

GpibRequest GpibRequest::from(const Char8ArrayMessage& message, const GpibLimits& limits) {
  const Char8Array fields = *message;
  GpibRequest request;
  request.until = Deadline::after(timeoutOf(fields, limits));
  request.extra = fields.extra;
  request.data.assign(message.value().begin(), message.value().end());
  request.problem = readCommand(fields, request);
  if (request.problem.empty()) request.problem = readAddresses(fields, request);
  if (request.problem.empty()) request.problem = readLimits(fields, limits, request);
  return request;
}

std::string GpibRequest::text() const {
  const auto at = static_cast<std::size_t>(command);
  auto text = std::string(at < kNames.size() ? kNames.at(at) : kNames.front());
  if (!addresses.empty()) text += " of " + toString(addresses.front());
  return text;
}

}  // namespace mpf
