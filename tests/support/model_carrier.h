// SPDX-License-Identifier: MIT
// addModelCarrier(): a carrier for models among the carriers of a test.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <mpf/drivers/industry_pack/model_carrier.h>

namespace mpf::test {

// `carriers` owns it.
inline ModelCarrier& addModelCarrier(IndustryPackCarriers& carriers,
                                     const std::string& name = "ipac") {
  auto carrier = std::make_unique<ModelCarrier>();
  auto& added = *carrier;
  carriers.add(name, std::move(carrier));
  return added;
}

}  // namespace mpf::test
