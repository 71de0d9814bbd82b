// SPDX-License-Identifier: MIT
#include "shm/segment_name.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <vector>

#include "base/number.h"
#include "base/printable.h"
#include "shm/layout.h"

namespace mpf {
namespace {

bool isPlain(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

// Server names may contain slashes and dots ("AIM1/1"), which the names of segments must not
// contain: each such character becomes a percent sign and two hexadecimal digits.
std::string encode(std::string_view name) {
  std::string encoded;
  for (const char c : name) {
    if (isPlain(c) || c == '[' || c == ']') {
      encoded += c;
    } else {
      encoded += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return encoded;
}

std::vector<std::string_view> split(std::string_view name) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto dot = name.find('.');
    parts.push_back(name.substr(0, dot));
    if (dot == std::string_view::npos) return parts;
    name.remove_prefix(dot + 1);
  }
}

// Numbers as the functions below write them: with another spelling, a second file could have the
// incarnation of a first one.
std::optional<std::uint64_t> tryHex(std::string_view text) {
  const auto number = tryNumber<std::uint64_t>(text, 16);
  const bool isOurs = text.find_first_of("ABCDEF") == std::string_view::npos &&
                      (text.size() == 1 || !text.starts_with('0'));
  return isOurs ? number : std::nullopt;
}
template <class Number>
std::optional<Number> tryDecimal(std::string_view text) {
  const auto number = tryNumber<Number>(text);
  return number && fmt::to_string(*number) == text ? number : std::nullopt;
}

bool isBackplane(std::string_view name) {
  return !name.empty() && name.size() < layout::kBackplaneChars &&
         std::all_of(name.begin(), name.end(), isPlain);
}

// Whether `name` is a possible result of encode().
bool isEncoded(std::string_view name) {
  const auto isUpperHex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F'); };
  for (std::size_t at = 0; at < name.size(); ++at) {
    if (isPlain(name[at]) || name[at] == '[' || name[at] == ']') continue;
    if (name[at] != '%' || name.size() - at < 3 || !isUpperHex(name[at + 1]) ||
        !isUpperHex(name[at + 2]))
      return false;
    at += 2;
  }
  return !name.empty();
}

}  // namespace

void SegmentName::checkBackplane(std::string_view backplane) {
  if (!isBackplane(backplane)) {
    throw std::invalid_argument(
        fmt::format("backplane name \"{}\": use 1 to {} of the characters A-Z a-z 0-9 _ -",
                    printable(backplane), layout::kBackplaneChars - 1));
  }
}

void SegmentName::checkServer(std::string_view server) {
  const auto isControl = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; };
  if (server.empty() || server.size() >= layout::kNameChars ||
      std::any_of(server.begin(), server.end(), isControl)) {
    throw std::invalid_argument(
        fmt::format("server name \"{}\": use 1 to {} bytes without control characters",
                    printable(server), layout::kNameChars - 1));
  }
}

std::string SegmentName::prefix(std::string_view backplane) {
  return backplane.empty() ? std::string("mpf.") : fmt::format("mpf.{}.", backplane);
}

std::string SegmentName::serverWindow(std::string_view backplane, std::int32_t location,
                                      std::string_view server) {
  return fmt::format("mpf.{}.s.{}.{}", backplane, location, encode(server));
}

std::string SegmentName::keyed(std::string_view backplane, NameKind kind,
                               std::uint64_t incarnation) {
  return fmt::format("mpf.{}.{}.{:x}", backplane, static_cast<char>(kind), incarnation);
}

std::string SegmentName::linkPrefix(std::string_view backplane, std::uint64_t serverWindow) {
  return fmt::format("mpf.{}.l.{:x}.", backplane, serverWindow);
}

std::string SegmentName::link(std::string_view backplane, std::uint64_t serverWindow,
                              std::uint64_t link) {
  return fmt::format("{}{:x}", linkPrefix(backplane, serverWindow), link);
}

std::string SegmentName::bulk(std::string_view backplane, std::uint64_t link, std::uint32_t side,
                              std::uint32_t segment) {
  return bulkText(backplane, link, side, segment).data();
}

SegmentName::Text SegmentName::bulkText(std::string_view backplane, std::uint64_t link,
                                        std::uint32_t side, std::uint32_t segment) noexcept {
  Text text{};
  fmt::format_to_n(text.data(), text.size() - 1, "mpf.{}.b.{:x}.{}.{}", backplane, link, side,
                   segment);
  return text;
}

std::string SegmentName::fanOutPrefix(std::string_view backplane, std::uint64_t serverWindow) {
  return fmt::format("mpf.{}.p.{:x}.", backplane, serverWindow);
}

std::string SegmentName::fanOut(std::string_view backplane, std::uint64_t serverWindow,
                                std::uint32_t segment) {
  return fmt::format("{}{}", fanOutPrefix(backplane, serverWindow), segment);
}

std::optional<SegmentName::Parsed> SegmentName::tryParse(std::string_view name) {
  const auto parts = split(name);
  if (parts.size() < 4 || parts[0] != "mpf" || !isBackplane(parts[1]) || parts[2].size() != 1)
    return std::nullopt;
  Parsed parsed;
  parsed.backplane = parts[1];
  parsed.kind = static_cast<NameKind>(parts[2][0]);
  switch (parsed.kind) {
    case NameKind::serverWindow:
      if (parts.size() != 5 || !tryDecimal<std::int32_t>(parts[3]) || !isEncoded(parts[4]))
        return std::nullopt;
      return parsed;
    case NameKind::link: {
      const auto server = tryHex(parts[3]);
      const auto link = parts.size() == 5 ? tryHex(parts[4]) : std::nullopt;
      if (!server || !link) return std::nullopt;
      parsed.serverWindow = *server;
      parsed.incarnation = *link;
      return parsed;
    }
    case NameKind::fanOut: {
      const auto server = tryHex(parts[3]);
      if (!server || parts.size() != 5 || !tryDecimal<std::uint32_t>(parts[4])) return std::nullopt;
      parsed.incarnation = *server;
      return parsed;
    }
    case NameKind::bulk: {
      const auto side = parts.size() == 6 ? tryDecimal<std::uint32_t>(parts[4]) : std::nullopt;
      const auto segment = side && *side < 2 ? tryDecimal<std::uint32_t>(parts[5]) : std::nullopt;
      if (!segment) return std::nullopt;
      parsed.side = *side;
      parsed.segment = *segment;
      [[fallthrough]];
    }
    case NameKind::clientWindow:
    case NameKind::hints:
    case NameKind::pendingBind:
    case NameKind::router:
    case NameKind::reaper:
    case NameKind::fifo: {
      const auto incarnation = tryHex(parts[3]);
      if (!incarnation || parts.size() != (parsed.kind == NameKind::bulk ? 6u : 4u))
        return std::nullopt;
      parsed.incarnation = *incarnation;
      return parsed;
    }
  }
  return std::nullopt;
}

}  // namespace mpf
