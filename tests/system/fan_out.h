// SPDX-License-Identifier: MIT
// What the camera of fan_out_test.cpp publishes to fan_out_actor.cpp, and what readers report.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <mpf/message_client.h>

namespace mpf::test {

// `cmd` of an Int32 of a reader. `address` is its number.
enum class FanOutRequest : std::int32_t {
  subscribe = 1,
  report = 2  // `value`: the image that it has received; `extra`: how many it has missed so far
};

inline constexpr std::size_t kPixels = 32'768;

[[nodiscard]] constexpr double imageElement(std::int32_t number) noexcept { return number + 0.25; }

[[nodiscard]] inline bool isWholeImage(const Message& message) noexcept {
  const auto* image = message.tryAs<Float64Array>();
  const auto pixels = message.valueAs<Float64Array>();
  return image != nullptr && pixels.size() == kPixels &&
         std::ranges::all_of(pixels, [expected = imageElement(image->extra)](double pixel) {
           return pixel == expected;
         });
}

}  // namespace mpf::test
