// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {

const char* toString(IndustryPackStatus status) noexcept {
  switch (status) {
    case IndustryPackStatus::badTable:
      return "S_IPAC_badTable";
    case IndustryPackStatus::tooMany:
      return "S_IPAC_tooMany";
    case IndustryPackStatus::badAddress:
      return "S_IPAC_badAddress";
    case IndustryPackStatus::badDriver:
      return "S_IPAC_badDriver";
    case IndustryPackStatus::noModule:
      return "S_IPAC_noModule";
    case IndustryPackStatus::noIpacId:
      return "S_IPAC_noIpacId";
    case IndustryPackStatus::badCrc:
      return "S_IPAC_badCRC";
    case IndustryPackStatus::badModule:
      return "S_IPAC_badModule";
    case IndustryPackStatus::notImplemented:
      return "S_IPAC_notImplemented";
    case IndustryPackStatus::badVector:
      return "S_IPAC_badVector";
    case IndustryPackStatus::vectorInUse:
      return "S_IPAC_vectorInUse";
    case IndustryPackStatus::badIntLevel:
      return "S_IPAC_badIntLevel";
  }
  return "S_IPAC_unknown";
}

}  // namespace mpf
