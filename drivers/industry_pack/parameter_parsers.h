// SPDX-License-Identifier: MIT
// One parser for each kind of carrier, for parseCarrierParameters(). Each reads all parameters of
// its kind; the caller refuses the rest of the text.
#pragma once

#include "drivers/industry_pack/carrier_parameters.h"
#include "drivers/industry_pack/parameter_text.h"

namespace mpf::parameters {

CarrierParameters parseVipc310(ParameterText& text);
CarrierParameters parseVipc610(ParameterText& text);
CarrierParameters parseVipc610Dash01(ParameterText& text);
CarrierParameters parseVipc616(ParameterText& text);
CarrierParameters parseVipc616Dash01(ParameterText& text);
CarrierParameters parseMvme162(ParameterText& text);
CarrierParameters parseTvme200(ParameterText& text);
CarrierParameters parseHytec(ParameterText& text);
CarrierParameters parseAvme96xx(ParameterText& text);
CarrierParameters parseAtc40(ParameterText& text);

// `count` sites from address `base`, in the layout of all these carriers: 0x100 bytes for each
// site, with the ID PROM in the upper half.
std::vector<SiteParameters> makeSites(std::size_t count, std::uint32_t base);

// Checks that the memory spaces of the sites are disjoint.
//   throws  IndustryPackError badAddress, which names the first site that overlaps with another one
void expectNoOverlap(const ParameterText& text, const std::vector<SiteParameters>& sites);

}  // namespace mpf::parameters
