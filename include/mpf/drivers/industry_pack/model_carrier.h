// SPDX-License-Identifier: MIT
// ModelCarrier: a carrier with device models instead of modules; simulates faults of real ones.
//
//   ModelCarrier carrier;
//   carrier.plug("IP_a", std::make_unique<Ip330Model>(...));
//   carrier.unplug("IP_a");                                    // all bits read as ones from now on
//   carrier.setFault("IP_a", ModelFault::interruptStorm);
//
// Threads  plug() and unplug() one at a time; bus cycles and setFault() by any thread. A model that
//          was unplugged exists until the carrier is destroyed, but gets no bus cycles.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/drivers/industry_pack/device_model.h>

namespace mpf {

enum class ModelFault : std::uint8_t {
  none,
  interruptStorm,  // the request lines are stuck active
  interruptsLost,  // no interrupt comes
  busError,  // every read returns ones, as if the module were pulled out
};

class ModelSite;

class ModelCarrier final : public IndustryPackCarrier {
 public:
  //   memoryBytes  size of the memory space of each site; jumpers or parameters set it on a real
  //                carrier
  explicit ModelCarrier(std::size_t sites = 4, std::size_t memoryBytes = 65536);
  ~ModelCarrier() override;

  // Puts a model into a site. The carrier owns it from now on; the returned reference is valid as
  // long as the carrier.
  //   throws  std::invalid_argument when the site does not exist or already has a model
  template <class Model>
  Model& plug(const std::string& siteName, std::unique_ptr<Model> model) {
    auto& plugged = *model;
    plugAny(siteName, std::move(model));
    return plugged;
  }
  // Takes the model out of a site: all reads return ones from now on.
  void unplug(const std::string& siteName);
  void setFault(const std::string& siteName, ModelFault fault);
  // Sets a fault of one interrupt request line only, 0 or 1.
  void setFault(const std::string& siteName, ModelFault fault, int line);

  [[nodiscard]] std::string description() const override { return "a carrier of models"; }
  [[nodiscard]] std::size_t siteCount() const noexcept override { return sites_.size(); }
  [[nodiscard]] IndustryPackSite& site(std::size_t number) override;

 private:
  void plugAny(const std::string& siteName, std::unique_ptr<DeviceModel> model);
  ModelSite& find(const std::string& siteName) const;
  std::vector<std::unique_ptr<ModelSite>> sites_;
  std::vector<std::unique_ptr<DeviceModel>> unplugged_;
};

}  // namespace mpf
