// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/registers.h>

#include <fmt/format.h>
#include <stdexcept>

namespace mpf {

void Registers::check(std::size_t offset, std::size_t width) const {
  if (offset % width != 0)
    throw std::invalid_argument(
        fmt::format("a {}-bit register at 0x{:x}: not a multiple of {}", 8 * width, offset, width));
  if (offset + width > size() || offset + width < offset) {
    throw std::out_of_range(fmt::format("a {}-bit register at 0x{:x}: the space has {} bytes",
                                        8 * width, offset, size()));
  }
}

}  // namespace mpf
