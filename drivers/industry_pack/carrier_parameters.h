// SPDX-License-Identifier: MIT
// CarrierParameters: the parameter strings of the VME and ISA carriers of old startup files, checked, and what they say.
//
//   const auto carrier = parseCarrierParameters("vipc616_01", "0x3000,0xa0000000");   // ipacAddCarrier(&vipc616_01, "0x3000,0xa0000000")
//   carrier.sites[1].memory                                                           // 0xa0800000, in VME A32
//
// Nothing is opened: whoever has a crate knows from here where its modules are.
//
// Source  EPICS ipac (drvIpac.html and the carriers' drivers), releases 2.3 to 2.16
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mpf {

// Where an address counts.
enum class BusSpace : std::uint8_t { vmeA16, vmeA24, vmeA32, local, isa };

struct SiteParameters {
  std::uint32_t io = 0;
  std::uint32_t id = 0;
  std::uint32_t memory = 0;
  std::uint32_t memoryBytes = 0;           // 0: this site has none
  std::array<int, 2> interruptLevels{};    // of IntReq0* and IntReq1*; 0: none
  int widthBits = 16;                      // of the memory space
  int recoveryUs = 0;                      // between two accesses
};

struct CarrierParameters {
  std::string board;  // "GreenSpring VIPC616-01"
  BusSpace registers = BusSpace::vmeA16;
  BusSpace memory = BusSpace::vmeA24;
  std::vector<SiteParameters> sites;
  bool isReset = false;               // before use
  std::optional<int> clockMHz;        // of all modules; nothing: as each says in its ID PROM
  bool releasesOnAcknowledge = false; // the interrupt request; otherwise when the module's registers are served
};

// Whether `kind` is one of these carriers: drvIpac's symbol ("&vipc616_01", "ipmv162"), its command ("ipacAddVIPC616_01"), in any case.
[[nodiscard]] bool isParameterKind(std::string_view kind);
// Their symbols: "vipc310", ....
[[nodiscard]] std::vector<std::string> parameterKinds();

//   throws  IndustryPackError badAddress or badIntLevel that names the part of `parameters` that cannot be, std::invalid_argument for another kind
[[nodiscard]] CarrierParameters parseCarrierParameters(std::string_view kind, std::string_view parameters);

}  // namespace mpf
