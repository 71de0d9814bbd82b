// SPDX-License-Identifier: MIT
// IndustryPackModule: a module at a site of a carrier, checked to be the one that its driver is for (manual, "IndustryPackModule").
//
//   IndustryPackModules modules(carriers);
//   auto& module = modules.create("Ip330_1", "ipac", "IP_a", kIp330);   // throws when another module is there, or none
//   module.io().write16(0, control);
//
// Threads  modules are created before they are used; afterwards any thread.
// Trust    an ID PROM may hold anything: what it says is compared, never used as a size.
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

// What a driver accepts.
struct ModuleKind {
  std::string name;  // "Acromag IP330"
  std::uint32_t manufacturer = 0;
  std::vector<std::uint16_t> models;
  struct Maker {
    std::uint32_t manufacturer = 0;
    std::vector<std::uint16_t> models;
  };
  // Who make modules that the same driver is for. Without {} g++ wants it in each initializer.
  std::vector<Maker> others{};  // NOLINT(readability-redundant-member-init)
};

inline constexpr std::uint32_t kAcromag = 0xa3;
inline constexpr std::uint32_t kGreenSpring = 0xf0;
inline constexpr std::uint32_t kSystran = 0x45;

class IndustryPackModule {
 public:
  IndustryPackModule(std::string name, std::string where, IndustryPackSite& site, ModuleKind kind);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // "carrier ipac, site IP_a"
  [[nodiscard]] const std::string& where() const noexcept { return where_; }
  [[nodiscard]] const IdProm& idProm() const noexcept { return prom_; }
  [[nodiscard]] const ModuleKind& kind() const noexcept { return kind_; }

  [[nodiscard]] Registers& io() noexcept { return site_.io(); }
  [[nodiscard]] Registers& memory() noexcept { return site_.memory(); }
  [[nodiscard]] Interrupt& interrupt(int number) { return site_.interrupt(number); }

  // Reads the ID PROM again. Empty: it is still there, or one of the same manufacturer and model; otherwise what is wrong, in a sentence.
  [[nodiscard]] std::string problem();

  // Returns `vector`.
  //   throws  IndustryPackError badVector unless it is 0 to 255
  [[nodiscard]] int checkedVector(int vector) const;

 private:
  std::string name_;
  std::string where_;
  IndustryPackSite& site_;
  ModuleKind kind_;
  IdProm prom_;
};

// Modules by name.
class IndustryPackModules {
 public:
  explicit IndustryPackModules(const IndustryPackCarriers& carriers) : carriers_(carriers) {}

  //   throws  IndustryPackError noModule, noIpacId, badCrc, badModule; std::invalid_argument when the name or the site is taken, or not there
  IndustryPackModule& create(const std::string& name, const std::string& carrierName, const std::string& siteName, const ModuleKind& kind);
  // Null when there is none.
  [[nodiscard]] IndustryPackModule* find(const std::string& name) const noexcept;
  [[nodiscard]] IndustryPackModule* find(const std::string& carrierName, const std::string& siteName) const noexcept;

  // Interrupt vectors are numbers that no two modules may share.
  //   throws  IndustryPackError badVector unless it is 0 to 255, vectorInUse
  void takeVector(int vector, const IndustryPackModule& module);

 private:
  const IndustryPackCarriers& carriers_;
  std::map<std::string, std::unique_ptr<IndustryPackModule>> modules_;
  std::map<std::string, IndustryPackModule*> bySite_;
  std::map<int, std::string> vectors_;
};

}  // namespace mpf
