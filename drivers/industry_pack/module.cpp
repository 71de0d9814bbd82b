// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/module.h>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

std::string whereOf(const std::string& carrierName, const std::string& siteName) {
  return fmt::format("carrier {}, site {}", carrierName, siteName);
}

void expectKind(const IdProm& prom, const ModuleKind& kind, const std::string& where) {
  const auto refuse = [&](const char* what, std::uint32_t found, const std::string& wanted) {
    throw IndustryPackError(IndustryPackStatus::badModule,
                            fmt::format("{} is not the expected {}: its {} is 0x{:02x}, not {}",
                                        where, kind.name, what, found, wanted));
  };
  const auto* models = prom.manufacturer == kind.manufacturer ? &kind.models : nullptr;
  auto makers = fmt::format("0x{:02x}", kind.manufacturer);
  for (const auto& other : kind.others) {
    if (prom.manufacturer == other.manufacturer) models = &other.models;
    makers += fmt::format(", 0x{:02x}", other.manufacturer);
  }
  if (models == nullptr) refuse("manufacturer", prom.manufacturer, makers);
  if (std::ranges::find(*models, prom.model) == models->end()) {
    refuse("model", prom.model, fmt::format("0x{:02x}", fmt::join(*models, ", 0x")));
  }
}

IdProm readChecked(IndustryPackSite& site, const ModuleKind& kind, const std::string& where) {
  const auto prom = readIdProm(site.id(), where);
  if (!prom.hasValidCrc) {
    throw IndustryPackError(IndustryPackStatus::badCrc,
                            fmt::format("{}: the CRC of the ID PROM is wrong (manufacturer "
                                        "0x{:02x}, model 0x{:02x}); check how the module is seated",
                                        where, prom.manufacturer, prom.model));
  }
  expectKind(prom, kind, where);
  return prom;
}

}  // namespace

IndustryPackModule::IndustryPackModule(std::string name, std::string where, IndustryPackSite& site,
                                       ModuleKind kind)
    : name_(std::move(name)),
      where_(std::move(where)),
      site_(site),
      kind_(std::move(kind)),
      prom_(readChecked(site_, kind_, where_)) {}

std::string IndustryPackModule::problem() {
  try {
    const auto now = readChecked(site_, kind_, where_);
    if (now.manufacturer == prom_.manufacturer && now.model == prom_.model) return {};
    return fmt::format(
        "{} has another {}: 0x{:02x}/0x{:02x} in place of 0x{:02x}/0x{:02x}; put the first one "
        "back, or restart the program",
        where_, kind_.name, now.manufacturer, now.model, prom_.manufacturer, prom_.model);
  } catch (const IndustryPackError& error) {
    return error.what();
  }
}

int IndustryPackModule::checkedVector(int vector) const {
  if (vector < 0 || vector > 255)
    throw IndustryPackError(
        IndustryPackStatus::badVector,
        fmt::format("module \"{}\": interrupt vector {} is not 0 to 255", name_, vector));
  return vector;
}

IndustryPackModule& IndustryPackModules::create(const std::string& name,
                                                const std::string& carrierName,
                                                const std::string& siteName,
                                                const ModuleKind& kind) {
  if (const auto* other = find(name))
    throw std::invalid_argument(fmt::format(
        "module \"{}\" exists already, at {}; choose another name", name, other->where()));
  auto where = whereOf(carrierName, siteName);
  if (const auto* other = find(carrierName, siteName))
    throw std::invalid_argument(
        fmt::format("{} already has the module \"{}\"", where, other->name()));
  auto module = std::make_unique<IndustryPackModule>(name, where,
                                                     carriers_.site(carrierName, siteName), kind);
  bySite_.emplace(where, module.get());
  return *modules_.emplace(name, std::move(module)).first->second;
}

IndustryPackModule* IndustryPackModules::find(const std::string& name) const noexcept {
  const auto found = modules_.find(name);
  return found == modules_.end() ? nullptr : found->second.get();
}

IndustryPackModule* IndustryPackModules::find(const std::string& carrierName,
                                              const std::string& siteName) const noexcept {
  const auto found = bySite_.find(whereOf(carrierName, siteName));
  return found == bySite_.end() ? nullptr : found->second;
}

void IndustryPackModules::takeVector(int vector, const IndustryPackModule& module) {
  const auto [taken, isNew] = vectors_.emplace(module.checkedVector(vector), module.name());
  if (!isNew && taken->second != module.name()) {
    throw IndustryPackError(
        IndustryPackStatus::vectorInUse,
        fmt::format(R"(module "{}": interrupt vector {} is used by module "{}")", module.name(),
                    vector, taken->second));
  }
}

}  // namespace mpf
