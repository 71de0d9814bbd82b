// SPDX-License-Identifier: MIT
// IndustryPackModule: a module in a site of a carrier, checked to be of the kind that its driver
// expects. IndustryPackModules: the modules of a program, by name (manual, "IndustryPackModule").
//
//   IndustryPackModules modules(carriers);
//   auto& module = modules.create("Ip330_1", "ipac", "IP_a", kIp330);   // throws if the site is
//                                                                       empty or has another module
//   module.io().write16(0, control);
//
// Threads  create all modules first, by one thread; afterwards any number of callers at a time.
// Crash    nothing is written to a module here.
// Trust    an ID PROM may contain anything: its values are compared, and its sizes are checked.
// Source   ANSI/VITA 4-1995; EPICS drvIpac for the errors.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/drivers/industry_pack/id_prom.h>

namespace mpf {

// The ID PROMs that a driver accepts.
struct ModuleKind {
  std::string name;  // "Acromag IP330"
  std::uint32_t manufacturer = 0;
  std::vector<std::uint16_t> models;  // any of these
  struct Maker {
    std::uint32_t manufacturer = 0;
    std::vector<std::uint16_t> models;
  };
  // Other manufacturers of modules for the same driver. Without {}, g++ requires this member in
  // each initializer.
  std::vector<Maker> others{};
};

// Manufacturers in the ID PROM.
inline constexpr std::uint32_t kAcromag = 0xa3;
inline constexpr std::uint32_t kGreenSpring = 0xf0;
inline constexpr std::uint32_t kSystran = 0x45;

class IndustryPackModule {
 public:
  // Reads the ID PROM; use IndustryPackModules::create().
  //   throws  IndustryPackError noModule, noIpacId, badCrc, badModule
  IndustryPackModule(std::string name, std::string where, IndustryPackSite& site, ModuleKind kind);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // The place, for messages to people: "carrier ipac, site IP_a".
  [[nodiscard]] const std::string& where() const noexcept { return where_; }
  [[nodiscard]] const IdProm& idProm() const noexcept { return prom_; }
  [[nodiscard]] const ModuleKind& kind() const noexcept { return kind_; }

  // The spaces and request lines (0 or 1) of the module, valid as long as the carrier.
  [[nodiscard]] Registers& io() noexcept { return site_.io(); }
  [[nodiscard]] Registers& memory() noexcept { return site_.memory(); }
  [[nodiscard]] Interrupt& interrupt(int number) { return site_.interrupt(number); }

  // Reads the ID PROM again.
  //   returns   a sentence that says what is wrong; empty when a module of the same manufacturer
  //             and model is present
  [[nodiscard]] std::string problem();

  // Returns `vector`, which is checked.
  //   throws  IndustryPackError badVector unless it is 0 to 255
  [[nodiscard]] int checkedVector(int vector) const;

 private:
  std::string name_;
  std::string where_;
  IndustryPackSite& site_;
  ModuleKind kind_;
  IdProm prom_;
};

// The modules of a program, by name.
class IndustryPackModules {
 public:
  // `carriers` must outlive this object.
  explicit IndustryPackModules(const IndustryPackCarriers& carriers) : carriers_(carriers) {}

  // Opens the module in a site and checks its ID PROM. The module is valid as long as this object.
  //   throws  IndustryPackError noModule, noIpacId, badCrc, badModule; std::invalid_argument when
  //           the name or the site is in use, or the carrier or site does not exist
  IndustryPackModule& create(const std::string& name, const std::string& carrierName,
                             const std::string& siteName, const ModuleKind& kind);
  // Returns nullptr when no such module was created.
  [[nodiscard]] IndustryPackModule* find(const std::string& name) const noexcept;
  [[nodiscard]] IndustryPackModule* find(const std::string& carrierName,
                                         const std::string& siteName) const noexcept;

  // Reserves an interrupt vector for a module; no two modules may have the same.
  //   throws  IndustryPackError badVector unless it is 0 to 255, vectorInUse
  void takeVector(int vector, const IndustryPackModule& module);

 private:
  const IndustryPackCarriers& carriers_;
  std::map<std::string, std::unique_ptr<IndustryPackModule>> modules_;
  std::map<std::string, IndustryPackModule*> bySite_;
  std::map<int, std::string> vectors_;
};

}  // namespace mpf
