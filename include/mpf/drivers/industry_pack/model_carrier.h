// SPDX-License-Identifier: MIT
// ModelCarrier: a carrier with device models instead of modules; simulates faults of real ones.
//
//   ModelCarrier carrier;
//   carrier.plug("IP_a", std::make_unique<Ip330Model>(...));
//   carrier.unplug("IP_a");                                    // all bits read as ones from now on
//   carrier.setFault("IP_a", ModelFault::interruptStorm);
//
// Drivers use it as any carrier. createCarrier() of kind "model" creates one with four sites. An
// empty site reads as ones and ignores writes, as on a real carrier.
//
// Threads  plug() and unplug() one at a time; bus cycles and setFault() by any thread. A model that
//          was unplugged exists until the carrier is destroyed, because a bus cycle may be in
//          progress; later cycles do not reach it.
// Crash    models and faults are memory of this process; nothing outlives it.
// Source   ANSI/VITA 4-1995: 128 bytes of ID space and of I/O space for each site.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/drivers/industry_pack/device_model.h>

namespace mpf {

// A fault of a site, which lasts until another one is set, also while models are exchanged. A site
// has one fault at a time; each interrupt request line may have another.
enum class ModelFault : std::uint8_t {
  none,  // the site works: ends the former fault
  interruptStorm,  // the request lines are stuck active: each enable() causes an interrupt at once
  interruptsLost,  // the carrier sees no interrupt, whatever the model drives
  // Every read returns ones, also of the ID space, writes are ignored and interrupts are lost, as
  // if the module were pulled out. Set for one line only, it is the same as interruptsLost.
  busError,
};

class ModelSite;

class ModelCarrier final : public IndustryPackCarrier {
 public:
  //   sites        number of sites: IP_a, IP_b, ...
  //   memoryBytes  size of the memory space of each site, 0 for none; jumpers or parameters set it
  //                on a real carrier
  //   throws       std::system_error when the process has no file descriptor left: each site needs
  //                two, for its interrupt request lines
  explicit ModelCarrier(std::size_t sites = 4, std::size_t memoryBytes = 65536);
  // Destroys the models. Drivers and interrupt threads that use a site must have ended before.
  ~ModelCarrier() override;

  // Puts a model, not null, into a site. The carrier owns it from now on; the returned reference is
  // valid as long as the carrier, also after unplug().
  //   throws  std::invalid_argument when the site does not exist or already has a model; the model
  //           is destroyed then
  template <class Model>
  Model& plug(const std::string& siteName, std::unique_ptr<Model> model) {
    auto& plugged = *model;
    plugAny(siteName, std::move(model));
    return plugged;
  }
  // Removes the model from a site: all reads return ones, writes are ignored and both interrupt
  // request lines are inactive from now on. Does nothing to a site without a model.
  //   throws  std::invalid_argument when the site does not exist
  void unplug(const std::string& siteName);
  // Sets the fault of a site and of both its lines; ModelFault::none ends it. Takes effect at once.
  //   throws  std::invalid_argument when the site does not exist
  void setFault(const std::string& siteName, ModelFault fault);
  // Sets a fault of one interrupt request line only, 0 or 1. The registers keep working.
  //   throws  as above; std::out_of_range for another line
  void setFault(const std::string& siteName, ModelFault fault, int line);

  [[nodiscard]] std::string description() const override { return "a model carrier"; }
  [[nodiscard]] std::size_t siteCount() const noexcept override { return sites_.size(); }
  // Valid as long as the carrier.
  //   throws  std::out_of_range unless number < siteCount()
  [[nodiscard]] IndustryPackSite& site(std::size_t number) override;

 private:
  void plugAny(const std::string& siteName, std::unique_ptr<DeviceModel> model);
  ModelSite& find(const std::string& siteName) const;
  std::vector<std::unique_ptr<ModelSite>> sites_;
  std::vector<std::unique_ptr<DeviceModel>> unplugged_;
};

}  // namespace mpf
