// SPDX-License-Identifier: MIT
// Dissection of a link: its states, rings, messages and pools. Part of dissect.h.
#pragma once

#include "tools/inspect/dissect.h"
#include "tools/inspect/segment_image.h"

namespace mpf::tools {

// Adds the states, rings, messages and pools of a link. `path` is the file that `image` was read
// from: it is read a second time, and the pools are read from the same folder.
void dissectLink(Tree& tree, const SegmentImage& image, const std::string& path,
                 const DissectOptions& options);

// Bytes as hexadecimal digits.
[[nodiscard]] std::string hexDigits(std::span<const std::byte> bytes);

}  // namespace mpf::tools
