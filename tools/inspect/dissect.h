// SPDX-License-Identifier: MIT
// Dissection: everything that a segment says, as a tree with the names of docs/shm-layout.md. Of a
// running system, or of a copy of its files made after the accident: what belongs together is
// looked for in the same folder.
//
//   link ─► header, states, two rings with their last messages ─► bodies in the bulk segments beside it
//   window ─► header, counters ─► its hints beside it
//
// Threads  one.
// Crash    reads only (SegmentImage); the segment's processes may be running, stopped, dead.
// Trust    files may hold anything: what makes no sense is said so in the tree, in the member
//          "problem".
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace mpf::tools {

using Tree = nlohmann::ordered_json;

struct DissectOptions {
  std::size_t last = 8;  // messages of each ring
  bool raw = false;  // bytes, too, as hexadecimal digits in members "raw"
};

// nullopt when there is no such file.
//   throws  SegmentError when it is no segment of a version that this program speaks,
//           std::system_error when it may not be read
[[nodiscard]] std::optional<Tree> tryDissect(const std::string& path,
                                             const DissectOptions& options);

// An incarnation as it stands in names.
[[nodiscard]] std::string hex(std::uint64_t incarnation);

}  // namespace mpf::tools
