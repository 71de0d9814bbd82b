// SPDX-License-Identifier: MIT
// SegmentName: builds and parses the names of segments in /dev/shm. layout.h lists them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mpf {

// The letter of each kind of name.
enum class NameKind : char {
  serverWindow = 's',
  clientWindow = 'c',
  hints = 'h',
  link = 'l',
  bulk = 'b',
  pendingBind = 'w',
  fifo = 'f',
  router = 'r',
  reaper = 'k',
  fanOut = 'p'
};

struct SegmentName {
  // Throws std::invalid_argument, which names the backplane, if a backplane name is empty, too long
  // or has other characters than [A-Za-z0-9_-].
  static void checkBackplane(std::string_view backplane);
  // Throws std::invalid_argument, which names the server, if a server name is empty, longer than 63
  // bytes or contains control characters.
  static void checkServer(std::string_view server);

  static std::string serverWindow(std::string_view backplane, std::int32_t location,
                                  std::string_view server);
  static std::string keyed(std::string_view backplane, NameKind kind, std::uint64_t incarnation);
  static std::string link(std::string_view backplane, std::uint64_t serverWindow,
                          std::uint64_t link);
  static std::string bulk(std::string_view backplane, std::uint64_t link, std::uint32_t side,
                          std::uint32_t segment);
  // As bulk(), for functions that must not fail: a text that ends with 0, and needs no memory.
  using Text = std::array<char, 256>;
  static Text bulkText(std::string_view backplane, std::uint64_t link, std::uint32_t side,
                       std::uint32_t segment) noexcept;

  static std::string fanOut(std::string_view backplane, std::uint64_t serverWindow,
                            std::uint32_t segment);

  // The prefix of all names of one backplane; of all backplanes if `backplane` is empty.
  static std::string prefix(std::string_view backplane);
  static std::string linkPrefix(std::string_view backplane, std::uint64_t serverWindow);
  static std::string fanOutPrefix(std::string_view backplane, std::uint64_t serverWindow);

  struct Parsed {
    std::string backplane;
    NameKind kind{};
    // incarnation in the name; 0 for a server window, whose name contains none
    std::uint64_t incarnation{};
    std::uint64_t serverWindow{};  // link only
    std::uint32_t side{}, segment{};  // bulk only
  };
  // Parses a name in /dev/shm; nullopt if it is not a name that MPF gives.
  static std::optional<Parsed> tryParse(std::string_view name);
};

}  // namespace mpf
