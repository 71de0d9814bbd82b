// SPDX-License-Identifier: MIT
#include "router/config/limit_text.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>

#include "base/number.h"
#include "base/time_text.h"
#include "shm/layout.h"

namespace mpf::router {
namespace {

struct Unit {
  const char* name;
  std::uint64_t size;
};
constexpr std::array<Unit, 4> kSizes{
    {{"GiB", 1u << 30}, {"MiB", 1u << 20}, {"KiB", 1u << 10}, {"", 1}}};
constexpr std::array<Unit, 1> kCounts{{{"", 1}}};

// "4MiB" -> 4 << 20.
template <std::size_t count>
std::uint64_t parseUnits(const std::string& text, const std::array<Unit, count>& units,
                         const char* how) {
  std::string_view rest = text;
  const auto number = tryTakeNumber<std::uint64_t>(rest);
  const auto* const unit = std::ranges::find(units, rest, &Unit::name);
  if (!number || unit == units.end() ||
      *number > std::numeric_limits<std::int64_t>::max() / unit->size) {
    throw std::invalid_argument(fmt::format("\"{}\": write {}", text, how));
  }
  return *number * unit->size;
}

template <std::size_t count>
std::string unitsText(std::uint64_t number, const std::array<Unit, count>& units) {
  const auto* const unit = std::ranges::find_if(
      units, [&](const Unit& one) { return number != 0 && number % one.size == 0; });
  const auto& chosen = unit == units.end() ? units.back() : *unit;
  return fmt::format("{}{}", number / chosen.size, chosen.name);
}

constexpr const char* kHowTime = "a time with its unit, such as 500ms, 2s or 1min";
constexpr const char* kHowSize = "a size in bytes, or with its unit: 4096, 64KiB, 4MiB, 1GiB";
constexpr const char* kHowCount = "a number";

enum class Kind { count, size, time };

struct Limit {
  const char* name;
  const char* purpose;
  Kind kind;
  std::uint64_t least;
  std::uint64_t most;
  std::uint64_t (*get)(const Limits&);
  void (*set)(Limits&, std::uint64_t);
};

template <auto member>
std::uint64_t getNumber(const Limits& limits) {
  return limits.*member;
}
template <auto member>
void setNumber(Limits& limits, std::uint64_t number) {
  limits.*member = static_cast<std::remove_reference_t<decltype(limits.*member)>>(number);
}
template <auto member>
std::uint64_t getTime(const Limits& limits) {
  return static_cast<std::uint64_t>((limits.*member).count());
}
template <auto member>
void setTime(Limits& limits, std::uint64_t ms) {
  limits.*member = std::chrono::milliseconds(ms);
}

template <auto member>
constexpr Limit numberLimit(const char* name, const char* purpose, Kind kind, std::uint64_t least,
                            std::uint64_t most) {
  return {name, purpose, kind, least, most, getNumber<member>, setNumber<member>};
}
template <auto member>
constexpr Limit timeLimit(const char* name, const char* purpose, std::uint64_t leastMs) {
  return {name, purpose, Kind::time, leastMs, 3'600'000, getTime<member>, setTime<member>};
}

constexpr std::uint64_t kGiB = 1u << 30;
constexpr std::array<Limit, 10> kLimits{{
    numberLimit<&Limits::queueSize>("queue-size",
                                    "Messages of one connection that may wait to be sent",
                                    Kind::count, 1, 1'000'000),
    numberLimit<&Limits::bufferBytes>("buffer-size",
                                      "Waiting messages share a frame of at most this size",
                                      Kind::size, 256, 64u << 20),
    numberLimit<&Limits::maxMessageBytes>(
        "max-message-size", "Largest message; larger ones are refused", Kind::size, 256, kGiB),
    numberLimit<&Limits::windowBytes>(
        "window-size", "Flow-control window: bytes of replies that one client has not taken yet",
        Kind::size, 4096, kGiB),
    numberLimit<&Limits::maxClients>("max-clients", "Clients of one connection", Kind::count, 1,
                                     layout::kMaxLinks),
    numberLimit<&Limits::maxConnections>("max-connections", "Accepted connections", Kind::count, 1,
                                         100'000),
    timeLimit<&Limits::deadTime>(
        "dead-time", "A connection on which nothing arrives for this time is closed", 100),
    timeLimit<&Limits::handshakeTime>(
        "handshake-time", "Longest time for a peer's TLS handshake, and then for its greeting",
        100),
    timeLimit<&Limits::firstRetry>(
        "first-retry",
        "Pause before the first attempt to reconnect; each further pause is twice as long", 1),
    timeLimit<&Limits::lastRetry>("last-retry", "Longest pause before an attempt to reconnect", 1),
}};

const Limit& limitOf(const std::string& name) {
  const auto* const limit = std::ranges::find(kLimits, name, &Limit::name);
  if (limit == kLimits.end())
    throw std::invalid_argument(fmt::format("unknown limit \"{}\"", name));
  return *limit;
}

std::uint64_t parseMs(const std::string& text, MissingUnit missing) {
  const auto time = tryTime(text, missing);
  if (!time) throw std::invalid_argument(fmt::format("\"{}\": write {}", text, kHowTime));
  return static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::milliseconds>(*time).count());
}

std::uint64_t parseKind(Kind kind, const std::string& text, MissingUnit missing) {
  if (kind == Kind::time) return parseMs(text, missing);
  return kind == Kind::size ? parseBytes(text) : parseUnits(text, kCounts, kHowCount);
}

std::string kindText(Kind kind, std::uint64_t number) {
  if (kind == Kind::time) return timeText(std::chrono::milliseconds(number));
  return kind == Kind::size ? unitsText(number, kSizes) : fmt::format("{}", number);
}

}  // namespace

std::uint64_t parseBytes(const std::string& text) { return parseUnits(text, kSizes, kHowSize); }

const std::vector<std::string>& limitNames() {
  static const auto names = [] {
    std::vector<std::string> all;
    all.reserve(kLimits.size());
    for (const auto& limit : kLimits) all.emplace_back(limit.name);
    return all;
  }();
  return names;
}

std::string limitPurpose(const std::string& name) { return limitOf(name).purpose; }

std::string limitType(const std::string& name) {
  const auto kind = limitOf(name).kind;
  if (kind == Kind::time) return "TIME";
  return kind == Kind::size ? "SIZE" : "NUMBER";
}

void setLimit(Limits& limits, const std::string& name, const std::string& text,
              MissingUnit missing) {
  const auto& limit = limitOf(name);
  const auto value = parseKind(limit.kind, text, missing);
  if (value < limit.least || value > limit.most) {
    throw std::invalid_argument(fmt::format("{} is out of range: use {} to {}", text,
                                            kindText(limit.kind, limit.least),
                                            kindText(limit.kind, limit.most)));
  }
  limit.set(limits, value);
}

std::string limitText(const Limits& limits, const std::string& name) {
  const auto& limit = limitOf(name);
  return kindText(limit.kind, limit.get(limits));
}

}  // namespace mpf::router
