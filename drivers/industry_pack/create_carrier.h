// SPDX-License-Identifier: MIT
// createCarrier(): a carrier of any kind, by the name of the kind and its parameters.
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/industry_pack/carrier.h>

namespace mpf {

//   kind        "model", or what carrierKinds() says
//   parameters  as that kind has them; of VME carriers drvIpac's strings
//   throws      std::invalid_argument when there is no such kind, IndustryPackError badAddress or badIntLevel when the parameters cannot be,
//               notImplemented when they can, but this host does not reach such a carrier,
//               std::runtime_error in plain words when it is not there or this process may not use it
[[nodiscard]] std::unique_ptr<IndustryPackCarrier> createCarrier(const std::string& kind, const std::string& parameters);

// A line for each kind: its name, its parameters, what it is. For --help.
[[nodiscard]] std::string carrierKinds();

}  // namespace mpf
