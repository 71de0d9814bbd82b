// SPDX-License-Identifier: MIT
// CarrierParameters: reads and checks the parameter strings of the VME and ISA carriers of old
// startup files.
//
//   // of the startup file: ipacAddCarrier(&vipc616_01, "0x3000,0xa0000000")
//   const auto carrier = parseCarrierParameters("vipc616_01", "0x3000,0xa0000000");
//   carrier.sites[1].memory                                  // 0xa0800000, in VME A32
//
// Nothing is opened: MPF cannot reach these buses. The result gives the addresses of the modules.
//
// Source  EPICS ipac (drvIpac.html and the drivers of the carriers), releases 2.3 to 2.16
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mpf {

// The address space of an address.
enum class BusSpace : std::uint8_t { vmeA16, vmeA24, vmeA32, local, isa };

struct SiteParameters {
  std::uint32_t io = 0;  // addresses of the three spaces on the carrier's bus
  std::uint32_t id = 0;
  std::uint32_t memory = 0;
  std::uint32_t memoryBytes = 0;  // 0: the site has no memory space
  std::array<int, 2> interruptLevels{};  // bus levels of IntReq0* and IntReq1*; 0: not connected
  int widthBits = 16;  // data width of the memory space
  int recoveryUs = 0;  // least time between two accesses
};

struct CarrierParameters {
  std::string board;  // "GreenSpring VIPC616-01"
  BusSpace registers = BusSpace::vmeA16;
  BusSpace memory = BusSpace::vmeA24;
  std::vector<SiteParameters> sites;
  bool isReset = false;  // the board is reset before use
  std::optional<int> clockMHz;  // of all modules; nullopt: as the ID PROM of each module says
  // the request ends in the acknowledge cycle; else at a register access
  bool releasesOnAcknowledge = false;
};

// Returns whether `kind` names such a carrier: a symbol of drvIpac ("&vipc616_01", "ipmv162") or a
// command ("ipacAddVIPC616_01"), in upper or lower case.
[[nodiscard]] bool isParameterKind(std::string_view kind);
// The symbols of all such carriers: "vipc310" and others.
[[nodiscard]] std::vector<std::string> parameterKinds();

// Reads the parameter string of a carrier.
//   throws  IndustryPackError badAddress or badIntLevel, which names the invalid part of
//           `parameters`; std::invalid_argument when the kind is unknown
[[nodiscard]] CarrierParameters parseCarrierParameters(std::string_view kind,
                                                       std::string_view parameters);

}  // namespace mpf
