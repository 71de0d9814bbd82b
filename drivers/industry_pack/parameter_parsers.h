// SPDX-License-Identifier: MIT
// The parser of each kind of carrier, for parseCarrierParameters(). Each reads all that its kind has; what is left is refused by the caller.
#pragma once

#include <mpf/drivers/industry_pack/carrier_parameters.h>
#include <mpf/drivers/industry_pack/parameter_text.h>

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

// `count` sites from `base`, in the layout that all these carriers have: 0x100 bytes a site, the ID PROM in the upper half.
std::vector<SiteParameters> makeSites(std::size_t count, std::uint32_t base);

//   throws  IndustryPackError badAddress that names the first site whose memory lies in another's
void expectNoOverlap(const ParameterText& text, const std::vector<SiteParameters>& sites);

}  // namespace mpf::parameters
