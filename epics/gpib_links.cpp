// SPDX-License-Identifier: MIT
#include "epics/gpib_links.h"

#include <fmt/format.h>
#include <stdexcept>

#include "shm/segment_name.h"

namespace mpf {

GpibLinks& GpibLinks::instance() {
  static GpibLinks links;
  return links;
}

void GpibLinks::add(int number, const GpibLink& link) {
  SegmentName::checkServer(link.server);
  const std::lock_guard lock(mutex_);
  const auto& present = links_.try_emplace(number, link).first->second;
  if (present == link) return;
  throw std::invalid_argument(fmt::format("GPIB link {} is \"{}\" at location {} already", number,
                                          present.server, present.location));
}

std::optional<GpibLink> GpibLinks::find(int number) const {
  const std::lock_guard lock(mutex_);
  const auto found = links_.find(number);
  return found == links_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace mpf
