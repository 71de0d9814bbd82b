// SPDX-License-Identifier: MIT
// IndustryPackError: an error of a carrier or a module, with the status that drvIpac uses for it.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace mpf {

// The numbers of drvIpac.h, where each is OR-ed with 600 << 16.
enum class IndustryPackStatus : std::uint8_t {
  badTable = 1,
  tooMany = 2,         // more than 21 carriers
  badAddress = 3,      // the parameters of a carrier are invalid
  badDriver = 4,
  noModule = 5,        // nothing answers at the site
  noIpacId = 6,        // the module has no ID PROM
  badCrc = 7,          // the CRC of the ID PROM is wrong
  badModule = 8,       // the site has another module
  notImplemented = 9,  // MPF cannot reach such a carrier
  badVector = 10,      // the vector is not 0 to 255
  vectorInUse = 11,    // another module has the vector
  badIntLevel = 12,    // the interrupt level is not 0 to 7
};

// The name in drvIpac.h, for example "S_IPAC_badAddress".
[[nodiscard]] const char* toString(IndustryPackStatus status) noexcept;

class IndustryPackError : public std::runtime_error {
 public:
  // `what` names the carrier, site or module and says what to do.
  IndustryPackError(IndustryPackStatus status, const std::string& what)
      : std::runtime_error(what), status_(status) {}
  [[nodiscard]] IndustryPackStatus status() const noexcept { return status_; }

 private:
  IndustryPackStatus status_;
};

}  // namespace mpf
