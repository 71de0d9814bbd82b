// SPDX-License-Identifier: MIT
// ModelCarrier: a carrier with models instead of modules, and what can go wrong with real ones.
//
//   ModelCarrier carrier;
//   carrier.plug("IP_a", std::make_unique<Ip330Model>(...));
//   carrier.unplug("IP_a");                                    // all bits read as ones from now on
//   carrier.setFault("IP_a", ModelFault::interruptStorm);
//
// Threads  any. A model that is unplugged lives on, unheard, until the carrier ends.
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
  interruptStorm,   // the request lines are stuck active
  interruptsLost,   // none ever comes
  busError,         // every access reads ones, as if it were pulled out
};

class ModelSite;

class ModelCarrier final : public IndustryPackCarrier {
 public:
  // Memory space of each site, in bytes; a real carrier's jumpers or parameters say how much.
  explicit ModelCarrier(std::size_t sites = 4, std::size_t memoryBytes = 65536);
  ~ModelCarrier() override;

  // Returns `model`, which this carrier owns from now on.
  //   throws  std::invalid_argument when there is no such site or it is taken
  template <class Model>
  Model& plug(const std::string& siteName, std::unique_ptr<Model> model) {
    auto& plugged = *model;
    plugAny(siteName, std::move(model));
    return plugged;
  }
  void unplug(const std::string& siteName);
  void setFault(const std::string& siteName, ModelFault fault);
  // A fault of the request lines, of one of them only.
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
