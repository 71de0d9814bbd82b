// SPDX-License-Identifier: MIT
// Dissection: the whole content of a segment as a tree, with the names of docs/shm-layout.md. The
// files may be those of a running system or copies. Files that belong together are expected in the
// same folder.
//
//   link ─► header, states, two rings with their last messages ─► bodies in its bulk segments
//   window ─► header, counters ─► its hints
//
// Threads  one.
// Crash    reads only (SegmentImage); the segment's processes may be running, stopped or dead.
// Trust    files are untrusted: the member "problem" of the tree describes invalid contents.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace mpf::tools {

using Tree = nlohmann::ordered_json;

struct DissectOptions {
  std::size_t last = 8;  // number of messages to show of each ring
  bool raw = false;      // adds the bytes, as hexadecimal digits in members "raw"
};

// nullopt when the file does not exist.
//   throws  SegmentError when it is not a segment, or one of an unsupported version,
//           std::system_error when it may not be read
[[nodiscard]] std::optional<Tree> tryDissect(const std::string& path,
                                             const DissectOptions& options);

// An incarnation as the names of segments contain it.
[[nodiscard]] std::string hex(std::uint64_t incarnation);
inline constexpr std::size_t kFewestDigits = 6;  // of hex() that name a link or a window

}  // namespace mpf::tools
