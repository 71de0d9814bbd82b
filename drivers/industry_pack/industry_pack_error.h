// SPDX-License-Identifier: MIT
// IndustryPackError: what can be wrong with a carrier or a module, with the status that drvIpac has for it.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace mpf {

// drvIpac.h; there each is OR-ed with 600 << 16.
enum class IndustryPackStatus : std::uint8_t {
  badTable = 1,
  tooMany = 2,         // carriers
  badAddress = 3,      // a carrier's parameters cannot be
  badDriver = 4,
  noModule = 5,        // nothing answers at that site
  noIpacId = 6,        // what answers has no ID PROM
  badCrc = 7,
  badModule = 8,       // it is another module
  notImplemented = 9,  // by this carrier
  badVector = 10,      // not 0 to 255
  vectorInUse = 11,
  badIntLevel = 12,
};

// "S_IPAC_badAddress"
[[nodiscard]] const char* toString(IndustryPackStatus status) noexcept;

class IndustryPackError : public std::runtime_error {
 public:
  // `what` names the carrier, the site or the module, and says what to do.
  IndustryPackError(IndustryPackStatus status, const std::string& what) : std::runtime_error(what), status_(status) {}
  [[nodiscard]] IndustryPackStatus status() const noexcept { return status_; }

 private:
  IndustryPackStatus status_;
};

}  // namespace mpf
