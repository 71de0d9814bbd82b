// SPDX-License-Identifier: MIT
#include <mpf/drivers/gpib/gpib_types.h>

#include <fmt/format.h>

namespace mpf {
namespace {

constexpr std::int32_t kPerPrimary = 100;

constexpr bool isAddress(std::int32_t number) noexcept {
  return number >= 0 && number <= GpibAddress::kHighest;
}

}  // namespace

std::optional<GpibAddress> GpibAddress::fromNumber(std::int32_t number) noexcept {
  const bool isPrimary = isAddress(number);
  const auto primary = isPrimary ? number : number / kPerPrimary;
  const auto secondary = number % kPerPrimary;
  if (!isPrimary && (primary < 1 || !isAddress(primary) || !isAddress(secondary)))
    return std::nullopt;
  GpibAddress address;
  address.primary = static_cast<std::uint8_t>(primary);
  if (!isPrimary) address.secondary = static_cast<std::uint8_t>(secondary);
  return address;
}

std::int32_t GpibAddress::number() const noexcept {
  if (primary == 0 || !secondary) return primary;
  return kPerPrimary * primary + *secondary;
}

std::string toString(const GpibAddress& address) {
  if (!address.secondary) return fmt::format("{}", address.primary);
  return fmt::format("{}.{}", address.primary, *address.secondary);
}

const char* toString(GpibStatus status) noexcept {
  switch (status) {
    case GpibStatus::success:
      return "success";
    case GpibStatus::timeout:
      return "timeout";
    case GpibStatus::noListener:
      return "no listener";
    case GpibStatus::failure:
      return "failure";
    case GpibStatus::unsupported:
      return "unsupported";
    case GpibStatus::leased:
      return "leased";
  }
  return "invalid status";
}

}  // namespace mpf
