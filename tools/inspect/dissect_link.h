// SPDX-License-Identifier: MIT
// Dissection of a link: its states, rings, messages and pools. Part of dissect.h.
#pragma once

#include "tools/inspect/dissect.h"
#include "tools/inspect/segment_image.h"

namespace mpf::tools {

// Adds what a link has beyond a header. `path` is where `image` was read: a second look goes there,
// and to the pools beside it.
void dissectLink(Tree& tree, const SegmentImage& image, const std::string& path,
                 const DissectOptions& options);

// Bytes as hexadecimal digits.
[[nodiscard]] std::string hexDigits(std::span<const std::byte> bytes);

}  // namespace mpf::tools
