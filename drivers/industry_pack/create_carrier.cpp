// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/create_carrier.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <stdexcept>

#include <mpf/drivers/industry_pack/industry_pack_error.h>
#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/industry_pack/carrier_parameters.h"
#include "drivers/industry_pack/check_carrier.h"
#include "drivers/industry_pack/tpci200.h"

namespace mpf {
namespace {

struct Kind {
  const char* name;
  const char* parameters;
  const char* what;
  void (*check)(const std::string& parameters);
  std::unique_ptr<IndustryPackCarrier> (*create)(const std::string& parameters);
};

constexpr std::size_t kSites = 4;  // of each kind

void checkModel(const std::string& parameters) {
  if (!parameters.empty()) throw std::invalid_argument("carrier kind \"model\" has no parameters");
}

std::unique_ptr<IndustryPackCarrier> createModel(const std::string& parameters) {
  checkModel(parameters);
  return std::make_unique<ModelCarrier>(kSites);
}

void checkTpci200(const std::string& parameters) {
  static_cast<void>(Tpci200Options::parse(parameters));
}

std::unique_ptr<IndustryPackCarrier> createTpci200(const std::string& parameters) {
  return std::make_unique<Tpci200>(Tpci200Options::parse(parameters));
}

constexpr std::array kKinds{
    Kind{"model", "", "four sites with models of the modules that a program drives", checkModel,
         createModel},
    Kind{"tpci200", "[ADDRESS|NUMBER][,poll=US]",
         "TEWS TPCI200, a PCI board: at ADDRESS (lspci), or the NUMBERth from 0", checkTpci200,
         createTpci200}};

// Checks the parameters nevertheless, so that an error in an old startup file is found on this
// host.
[[noreturn]] void refuseOutOfReach(const std::string& kind, const std::string& parameters) {
  const auto carrier = parseCarrierParameters(kind, parameters);
  throw IndustryPackError(
      IndustryPackStatus::notImplemented,
      fmt::format("{}: \"{}\" is valid, but this host has no access to {}. Put the modules on a "
                  "PCI carrier and use kind "
                  "tpci200, or use kind model, which has models of the modules",
                  carrier.board, parameters,
                  carrier.registers == BusSpace::isa ? "an ISA bus" : "a VME crate"));
}

const Kind& findKind(const std::string& kind, const std::string& parameters) {
  for (const auto& known : kKinds) {
    if (known.name == kind) return known;
  }
  if (isParameterKind(kind)) refuseOutOfReach(kind, parameters);
  throw std::invalid_argument(
      fmt::format("unknown carrier kind \"{}\"; the kinds are:\n{}", kind, carrierKinds()));
}

}  // namespace

std::size_t checkCarrier(const std::string& text) {
  const auto colon = std::min(text.find(':'), text.size());
  const auto parameters = text.substr(std::min(colon + 1, text.size()));
  findKind(text.substr(0, colon), parameters).check(parameters);
  return kSites;
}

std::unique_ptr<IndustryPackCarrier> createCarrier(const std::string& kind,
                                                   const std::string& parameters) {
  return findKind(kind, parameters).create(parameters);
}

std::string carrierKinds() {
  std::string text;
  for (const auto& kind : kKinds)
    text += fmt::format("  {}{}{}  {}\n", kind.name, *kind.parameters == '\0' ? "" : ":",
                        kind.parameters, kind.what);
  return text +
         "  vipc616_01, ipmv162, tvme200 and other VME and ISA carriers: only their parameters are "
         "checked\n";
}

}  // namespace mpf
