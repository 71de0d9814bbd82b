// SPDX-License-Identifier: MIT
// createCarrier(): creates a carrier by the name of its kind and its parameters.
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/industry_pack/carrier.h>

namespace mpf {

// Creates and opens a carrier.
//
//   kind        "model" or another kind of carrierKinds()
//   parameters  as the kind defines them; for VME and ISA carriers the strings of drvIpac
//   throws      std::invalid_argument for an unknown kind;
//               IndustryPackError badAddress or badIntLevel for invalid parameters, notImplemented
//               for a valid carrier on a bus that MPF cannot reach;
//               std::runtime_error when the board is absent or this process may not use it
[[nodiscard]] std::unique_ptr<IndustryPackCarrier> createCarrier(const std::string& kind,
                                                                 const std::string& parameters);

// One line for each kind, for --help: name, parameters, description.
[[nodiscard]] std::string carrierKinds();

}  // namespace mpf
