// SPDX-License-Identifier: MIT
#include "drivers/ip440/ip440.h"

namespace mpf {
namespace {

constexpr std::size_t kPorts = 4;
constexpr std::size_t kNotUsed = 0x7f;  // reads as 0 while a module is present, as 0xff without one

// A port is on the lower half of the 16-bit data bus, which is the byte at the odd address.
std::size_t offsetOf(std::size_t port) noexcept { return 2 * port + 1; }

}  // namespace

std::optional<std::uint32_t> Ip440::tryRead() noexcept {
  const std::lock_guard lock(mutex_);
  std::uint32_t bits = 0;
  for (std::size_t port = 0; port < kPorts; ++port)
    bits |= std::uint32_t{registers_.read8(offsetOf(port))} << (8 * port);
  const bool isDoubtful = isGone_ || registers_.read8(kNotUsed) != 0;
  // the site may be empty, or have another module
  if (isDoubtful) isGone_ = !module_.problem().empty();
  return isGone_ ? std::nullopt : std::optional(bits);
}

}  // namespace mpf
