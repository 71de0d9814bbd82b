// SPDX-License-Identifier: MIT
// IndustryPackModule in the form of the original MPF: finds a module in a site of a carrier and
// tells what it is (manual, "IndustryPackModule").
//
//   mpf::classic::addCarrier("ipac", mpf::createCarrier("tpci200", "0000:03:00.0"));
//   IndustryPackModule* module =
//       IndustryPackModule::createIndustryPackModule("adc", "ipac", "IP_a");
//   if (module && module->getModel() == 0x11) ...
//
// Registers and interrupts are those of <mpf/drivers/industry_pack/module.h>: on Linux they are not
// plain memory, and no vector leads to a program. open() gives the module to a driver of MPF.
//
// Threads  any.
// Throws   only open() and addCarrier().
// Source   manual, "IndustryPackModule".
#pragma once

#include <memory>

#include <mpf/drivers/industry_pack/module.h>

namespace mpf::classic {

// Makes a carrier known under a name, as initIpacCarrier() did. It exists until the program ends.
//   throws  as mpf::IndustryPackCarriers::add()
void addCarrier(const char* name, std::unique_ptr<IndustryPackCarrier> carrier);

}  // namespace mpf::classic

class IndustryPackModule {
 public:
  // The module exists until the program ends.
  //   returns  null, after a message to stderr, when the carrier, the site or the module does not
  //            exist, or the name is in use
  static IndustryPackModule* createIndustryPackModule(const char* moduleName,
                                                      const char* carrierName,
                                                      const char* siteName);
  // Return null when no such module was created.
  static IndustryPackModule* find(const char* moduleName);
  static IndustryPackModule* find(const char* carrierName, const char* siteName);

  unsigned char getManufacturer() const;
  unsigned char getModel() const;
  unsigned char getRevision() const;

  // The module for a driver of MPF, checked to be of its kind.
  //   throws  as mpf::IndustryPackModules::create()
  mpf::IndustryPackModule& open(const mpf::ModuleKind& kind);

  IndustryPackModule(const IndustryPackModule&) = delete;
  IndustryPackModule& operator=(const IndustryPackModule&) = delete;

 private:
  class Impl;
  explicit IndustryPackModule(std::unique_ptr<Impl> impl);
  ~IndustryPackModule();
  std::unique_ptr<Impl> impl_;
};
