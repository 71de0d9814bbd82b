// SPDX-License-Identifier: MIT
// SegmentName: the names of segments in /dev/shm, built and taken apart. The grammar is in
// layout.h.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mpf {

// Name of a segment whose key is an incarnation number.
enum class NameKind : char {
  serverWindow = 's',
  clientWindow = 'c',
  hints = 'h',
  link = 'l',
  bulk = 'b',
  pendingBind = 'w',
  fifo = 'f',
  router = 'r',
  reaper = 'k'
};

struct SegmentName {
  // Throws std::invalid_argument, naming it, when a backplane name is empty, too long or has other
  // characters than [A-Za-z0-9_-].
  static void checkBackplane(std::string_view backplane);
  // Throws std::invalid_argument, naming it, when a server name is empty, longer than 63 bytes or
  // holds control characters.
  static void checkServer(std::string_view server);

  static std::string serverWindow(std::string_view backplane, std::int32_t location,
                                  std::string_view server);
  static std::string keyed(std::string_view backplane, NameKind kind, std::uint64_t incarnation);
  static std::string link(std::string_view backplane, std::uint64_t serverWindow,
                          std::uint64_t link);
  static std::string bulk(std::string_view backplane, std::uint64_t link, std::uint32_t side,
                          std::uint32_t segment);

  // Everything of one backplane, or of all when `backplane` is empty, starts so.
  static std::string prefix(std::string_view backplane);
  static std::string linkPrefix(std::string_view backplane, std::uint64_t serverWindow);

  // What a name in /dev/shm says; nullopt when it is not ours.
  struct Parsed {
    std::string backplane;
    NameKind kind{};
    // of the segment itself; 0 for a server window, whose name is the server's
    std::uint64_t incarnation{};
    std::uint64_t serverWindow{};  // link only
  };
  static std::optional<Parsed> tryParse(std::string_view name);
};

}  // namespace mpf
