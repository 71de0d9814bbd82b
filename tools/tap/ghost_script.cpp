// SPDX-License-Identifier: MIT
#include "tools/tap/ghost_script.h"

#include <cstring>
#include <fmt/format.h>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/saturating.h"
#include "schema/conversion.h"
#include "schema/visit.h"
#include "tools/tap/recording.h"

namespace mpf::tools {
namespace {

constexpr ConversionLimits kNoLimit{.maxValueBytes = SIZE_MAX};

// The type and the fields that `isWanted` accepts, as bytes.
template <class IsWanted>
std::string keyOf(const Message& message, IsWanted isWanted) {
  std::string key;
  const auto add = [&](const void* bytes, std::size_t size) {
    key.append(static_cast<const char*>(bytes), size);
  };
  const auto type = message.getType();
  add(&type, sizeof type);
  visitFields(message, [&](std::string_view name, const auto& value) {
    if (!isWanted(name)) return;
    if constexpr (requires { value.data(); }) {
      const auto size = value.size() * sizeof(*value.data());
      add(&size, sizeof size);
      add(value.data(), size);
    } else {
      add(&value, sizeof value);
    }
  });
  return key;
}
std::string sameKey(const Message& message) {
  return keyOf(message, [](std::string_view) { return true; });
}
std::string similarKey(const Message& message) {
  return keyOf(message,
               [](std::string_view name) { return name != kValueName && name != "timeout"; });
}

}  // namespace

// Fills in the script, record by record.
class GhostScript::Reading {
 public:
  Reading(GhostScript& script, const RecordingReader& reader) : script_(script), reader_(reader) {}

  void take(wire::Record::Reader record) {
    const auto link = record.getLink();
    if (record.isOpened()) {
      const std::string server = record.getOpened().getServer().cStr();
      if (script_.server_.empty()) script_.server_ = server;
      isOurs_[link] = server == script_.server_;
    }
    if (!isOurs_[link]) return;
    if (record.isMissed()) missed_[link] = record.getMissed();
    if (record.isMessage()) take(link, record.getAtNs(), record.getMessage());
  }
  [[nodiscard]] std::uint64_t missed() const {
    std::uint64_t sum = 0;
    for (const auto& [link, count] : missed_) sum += count;
    return sum;
  }

 private:
  void take(std::uint64_t link, std::int64_t atNs, wire::Record::Message::Reader record) {
    ConversionError error;
    auto message = tryFromWire(record.getEnvelope(), kNoLimit, error);
    if (!message)
      throw std::runtime_error(
          fmt::format("{}: the message is damaged: {}", reader_.place(), error.text));
    const auto id = std::pair(link, record.getRequestId());
    auto& exchanges = script_.exchanges_;
    if (record.getDirection() == wire::Direction::REQUEST) {
      script_.same_[sameKey(*message)].exchanges.push_back(exchanges.size());
      script_.similar_[similarKey(*message)].exchanges.push_back(exchanges.size());
      byRequest_[id] = exchanges.size();
      exchanges.push_back({.atNs = atNs, .replies = {}});
    } else if (const auto asked = byRequest_.find(id); asked != byRequest_.end()) {
      auto& exchange = exchanges[asked->second];
      exchange.replies.push_back({.after = Nanoseconds(saturatingDifference(atNs, exchange.atNs)),
                                  .atNs = atNs,
                                  .message = std::move(*message)});
    }
  }

  GhostScript& script_;
  const RecordingReader& reader_;
  std::map<std::uint64_t, bool> isOurs_;  // by link
  std::map<std::uint64_t, std::uint64_t> missed_;
  std::map<std::pair<std::uint64_t, std::uint32_t>, std::size_t> byRequest_;
};

GhostScript::GhostScript(const std::string& file) {
  RecordingReader reader(file);
  Reading reading(*this, reader);
  while (reader.tryNext([&](wire::Record::Reader record) { reading.take(record); })) continue;
  missed_ = reading.missed();
  if (exchanges_.empty()) throw std::runtime_error(file + ": no request in it");
}

GhostScript::Found GhostScript::next(const Message& request) {
  if (const auto same = same_.find(sameKey(request)); same != same_.end())
    return {&exchanges_[same->second.next()], Match::same};
  if (const auto similar = similar_.find(similarKey(request)); similar != similar_.end())
    return {&exchanges_[similar->second.next()], Match::similar};
  return {};
}

}  // namespace mpf::tools
