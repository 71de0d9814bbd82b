// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/carrier.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

constexpr std::size_t kMaxCarriers = 21;  // the limit of drvIpac

}  // namespace

std::string siteName(std::size_t number) {
  return fmt::format("IP_{}", static_cast<char>('a' + number));
}

void IndustryPackCarriers::add(const std::string& name,
                               std::unique_ptr<IndustryPackCarrier> carrier) {
  if (name.empty()) throw std::invalid_argument("a carrier needs a name");
  if (carriers_.contains(name))
    throw std::invalid_argument(fmt::format(
        "carrier \"{}\" exists already: {}; choose another name", name, find(name).description()));
  if (carriers_.size() == kMaxCarriers) {
    throw IndustryPackError(
        IndustryPackStatus::tooMany,
        fmt::format("carrier \"{}\" cannot be added: {} carriers exist already, which is the limit",
                    name, kMaxCarriers));
  }
  carriers_.emplace(name, std::move(carrier));
}

IndustryPackCarrier& IndustryPackCarriers::find(const std::string& name) const {
  const auto found = carriers_.find(name);
  if (found == carriers_.end())
    throw std::invalid_argument(
        fmt::format("no carrier \"{}\"; carriers: {}", name, fmt::join(names(), ", ")));
  return *found->second;
}

IndustryPackSite& IndustryPackCarriers::site(const std::string& carrierName,
                                             const std::string& siteName) const {
  auto& carrier = find(carrierName);
  for (std::size_t i = 0; i < carrier.siteCount(); ++i) {
    if (mpf::siteName(i) == siteName) return carrier.site(i);
  }
  throw std::invalid_argument(fmt::format(
      R"(carrier "{}" ({}) has no site "{}"; it has {} to {})", carrierName, carrier.description(),
      siteName, mpf::siteName(0), mpf::siteName(carrier.siteCount() - 1)));
}

std::vector<std::string> IndustryPackCarriers::names() const {
  std::vector<std::string> names;
  names.reserve(carriers_.size());
  for (const auto& [name, carrier] : carriers_) names.push_back(name);
  return names;
}

}  // namespace mpf
