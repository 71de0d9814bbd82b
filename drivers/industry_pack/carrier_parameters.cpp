// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/carrier_parameters.h"

#include <algorithm>
#include <cctype>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdexcept>

#include "drivers/industry_pack/parameter_parsers.h"

namespace mpf {
namespace {

struct ParameterKind {
  std::string_view symbol;
  std::string_view board;
  CarrierParameters (*parse)(ParameterText& text);
};

constexpr std::array kParameterKinds{
    ParameterKind{"vipc310", "GreenSpring VIPC310", parameters::parseVipc310},
    ParameterKind{"vipc610", "GreenSpring VIPC610", parameters::parseVipc610},
    ParameterKind{"vipc610_01", "GreenSpring VIPC610-01", parameters::parseVipc610Dash01},
    ParameterKind{"vipc616", "GreenSpring VIPC616", parameters::parseVipc616},
    ParameterKind{"vipc616_01", "GreenSpring VIPC616-01", parameters::parseVipc616Dash01},
    ParameterKind{"ipmv162", "Motorola MVME162", parameters::parseMvme162},
    ParameterKind{"mvme162", "Motorola MVME162", parameters::parseMvme162},
    ParameterKind{"tvme200", "TEWS TVME200", parameters::parseTvme200},
    ParameterKind{"hy8002", "Hytec 8002", parameters::parseHytec},
    ParameterKind{"hy8004", "Hytec 8004", parameters::parseHytec},
    ParameterKind{"xy9660", "Xycom XVME-9660", parameters::parseAvme96xx},
    ParameterKind{"avme96xx", "Acromag AVME-96xx", parameters::parseAvme96xx},
    ParameterKind{"atc40", "SBS ATC40", parameters::parseAtc40},
};

std::string symbolOf(std::string_view kind) {
  constexpr std::string_view kCommand = "ipacadd";
  std::string symbol(kind.substr(kind.starts_with('&') ? 1 : 0));
  std::ranges::transform(symbol, symbol.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  return symbol.starts_with(kCommand) ? symbol.substr(kCommand.size()) : symbol;
}

const ParameterKind* findKind(std::string_view kind) {
  const auto* const found =
      std::ranges::find(kParameterKinds, symbolOf(kind), &ParameterKind::symbol);
  return found == kParameterKinds.end() ? nullptr : found;
}

}  // namespace

bool isParameterKind(std::string_view kind) { return findKind(kind) != nullptr; }

std::vector<std::string> parameterKinds() {
  std::vector<std::string> symbols;
  symbols.reserve(kParameterKinds.size());
  for (const auto& kind : kParameterKinds) symbols.emplace_back(kind.symbol);
  return symbols;
}

CarrierParameters parseCarrierParameters(std::string_view kind, std::string_view parameters) {
  const auto* const known = findKind(kind);
  if (known == nullptr)
    throw std::invalid_argument(fmt::format("unknown carrier kind \"{}\"; use one of {}", kind,
                                            fmt::join(parameterKinds(), ", ")));
  ParameterText text(known->board, parameters);
  auto carrier = known->parse(text);
  text.expectEnd();
  carrier.board = known->board;
  return carrier;
}

}  // namespace mpf
