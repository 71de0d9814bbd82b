// SPDX-License-Identifier: MIT
#include <mpf/classic/industry_pack.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <mpf/drivers/industry_pack/id_prom.h>

#include "base/print_error.h"

class IndustryPackModule::Impl {
 public:
  std::string name, carrier, site;
  mpf::IdProm prom;
};

namespace {

// The carriers and modules of the program. Never destroyed: tasks may use them until it ends.
struct Hardware {
  std::mutex mutex;
  mpf::IndustryPackCarriers carriers;  // all under mutex
  mpf::IndustryPackModules opened{carriers};
  std::vector<IndustryPackModule*> modules;

  static Hardware& instance() {
    static auto* const hardware = new Hardware;
    return *hardware;
  }
  template <class Fits>
  IndustryPackModule* find(const Fits& fits) {
    const auto found = std::ranges::find_if(modules, fits);
    return found == modules.end() ? nullptr : *found;
  }
};

}  // namespace

void mpf::classic::addCarrier(const char* name, std::unique_ptr<IndustryPackCarrier> carrier) {
  auto& hardware = Hardware::instance();
  const std::lock_guard lock(hardware.mutex);
  hardware.carriers.add(name, std::move(carrier));
}

IndustryPackModule::IndustryPackModule(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
IndustryPackModule::~IndustryPackModule() = default;

IndustryPackModule* IndustryPackModule::createIndustryPackModule(const char* moduleName,
                                                                 const char* carrierName,
                                                                 const char* siteName) try {
  if (find(moduleName) != nullptr) throw std::invalid_argument("the name is in use");
  auto& hardware = Hardware::instance();
  const std::lock_guard lock(hardware.mutex);
  auto impl = std::make_unique<Impl>();
  impl->name = moduleName;
  impl->carrier = carrierName;
  impl->site = siteName;
  impl->prom = mpf::readIdProm(hardware.carriers.site(carrierName, siteName).id(),
                               "carrier " + impl->carrier + ", site " + impl->site);
  return hardware.modules.emplace_back(new IndustryPackModule(std::move(impl)));
} catch (const std::exception& error) {
  mpf::printError("IndustryPackModule {}: {}\n", moduleName, error.what());
  return nullptr;
}

IndustryPackModule* IndustryPackModule::find(const char* moduleName) {
  auto& hardware = Hardware::instance();
  const std::lock_guard lock(hardware.mutex);
  return hardware.find([&](const auto* module) { return module->impl_->name == moduleName; });
}

IndustryPackModule* IndustryPackModule::find(const char* carrierName, const char* siteName) {
  auto& hardware = Hardware::instance();
  const std::lock_guard lock(hardware.mutex);
  return hardware.find([&](const auto* module) {
    return module->impl_->carrier == carrierName && module->impl_->site == siteName;
  });
}

unsigned char IndustryPackModule::getManufacturer() const {
  return static_cast<unsigned char>(impl_->prom.manufacturer);
}
unsigned char IndustryPackModule::getModel() const {
  return static_cast<unsigned char>(impl_->prom.model);
}
unsigned char IndustryPackModule::getRevision() const {
  return static_cast<unsigned char>(impl_->prom.revision);
}

mpf::IndustryPackModule& IndustryPackModule::open(const mpf::ModuleKind& kind) {
  auto& hardware = Hardware::instance();
  const std::lock_guard lock(hardware.mutex);
  return hardware.opened.create(impl_->name, impl_->carrier, impl_->site, kind);
}
