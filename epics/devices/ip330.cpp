// SPDX-License-Identifier: MIT
// Device support of an Acromag IP330.
//
//   ai       "ip330Scan"    INP "#C<location> S<channel> @<server>[,gain code 0 to 3]"
//   longout  "ip330Config"  OUT "#C<location> S0 @<server>": seconds between calibrations
//
// Source  manual, "EXAMPLE Implementation: ip330Scan"; the EPICS module ip330.
#include <aiRecord.h>
#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <longoutRecord.h>
#include <string_view>

#include <mpf/epics/dev_mpf.h>
#include <mpf/ip330_commands.h>

#include "base/number.h"
#include "epics/common_fields.h"
#include "epics/linear_conversion.h"

namespace mpf {
namespace {

constexpr double kMaxCode = 0xffff;

std::string_view withoutBlanks(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

class DevAiIp330Scan final : public DevMpf {
 public:
  explicit DevAiIp330Scan(aiRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->inp) {
    const auto text = withoutBlanks(getUserParm());
    gain_ = text.empty() ? 0 : tryNumber<int>(text).value_or(-1);
    if (gain_ < 0 || gain_ > 3) {
      refuseLink(*this, reinterpret_cast<dbCommon*>(record), "INP",
                 fmt::format("gain \"{}\": use 0, 1, 2 or 3", text).c_str());
    }
    convert(reinterpret_cast<dbCommon*>(record), 1);
  }
  long startIO(dbCommon*) override {
    return sendReply(Int32Message({.address = getSignal(), .value = gain_}));
  }
  long completeIO(dbCommon* common, Message&& message) override {
    const auto* reply = message.tryAs<Int32>();
    if (reply == nullptr) return fail(common, "the reply is not an Int32 message");
    if (reply->status != 0) return fail(common, "the server cannot read the channel");
    auto* record = reinterpret_cast<aiRecord*>(common);
    record->rval = reply->value;
    record->udf = FALSE;
    return MPF_OK;
  }
  long convert(dbCommon* common, int) override {
    setLinearConversion(*reinterpret_cast<aiRecord*>(common), 0, kMaxCode);
    return 0;
  }
  static long init(dbCommon* record) {
    return bindDevice<DevAiIp330Scan>(reinterpret_cast<aiRecord*>(record));
  }

 private:
  int gain_ = 0;
};

class DevLoIp330Config final : public DevMpf {
 public:
  explicit DevLoIp330Config(longoutRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {}
  long startIO(dbCommon* record) override {
    return sendReply(Int32Message({.cmd = ip330server::cmdSetSecondsBetweenCalibrate,
                                   .value = reinterpret_cast<longoutRecord*>(record)->val}));
  }
  long completeIO(dbCommon* record, Message&& message) override {
    const auto* reply = message.tryAs<Int32>();
    if (reply == nullptr) return fail(record, "the reply is not an Int32 message");
    if (reply->status != 0) return fail(record, "the server refused the interval");
    return MPF_OK;
  }
  static long init(dbCommon* record) {
    return bindDevice<DevLoIp330Config>(reinterpret_cast<longoutRecord*>(record));
  }
};

}  // namespace

MAKE_LINCONV_DSET(devAiIp330Scan, DevAiIp330Scan::init)
MAKE_DSET(devLoIp330Config, DevLoIp330Config::init)

}  // namespace mpf
