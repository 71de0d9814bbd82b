// SPDX-License-Identifier: MIT
// Device support of a Systran DAC128V: ao "dac128V", OUT "#C<location> S<channel> @<server>".
//
// Source  the EPICS module dac128V.
#include <aoRecord.h>

#include <mpf/epics/dev_mpf.h>

#include "epics/linear_conversion.h"

namespace mpf {
namespace {

constexpr double kMaxCode = 4095;

class DevAoDac128v final : public DevMpf {
 public:
  explicit DevAoDac128v(aoRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {
    convert(reinterpret_cast<dbCommon*>(record), 1);
  }
  long startIO(dbCommon* record) override {
    return sendReply(
        Int32Message({.address = getSignal(), .value = reinterpret_cast<aoRecord*>(record)->rval}));
  }
  long completeIO(dbCommon* record, Message&& message) override {
    const auto* reply = message.tryAs<Int32>();
    if (reply == nullptr) return fail(record, "the reply is not an Int32 message");
    if (reply->status != 0) return fail(record, "the server refused the value");
    return MPF_OK;
  }
  long convert(dbCommon* common, int) override {
    setLinearConversion(*reinterpret_cast<aoRecord*>(common), 0, kMaxCode);
    return 0;
  }
  // MPF_NoConvert keeps the VAL of the database: the output is not known before the first write.
  static long init(dbCommon* record) {
    const auto status = bindDevice<DevAoDac128v>(reinterpret_cast<aoRecord*>(record));
    return status == 0 ? MPF_NoConvert : status;
  }
};

}  // namespace

MAKE_LINCONV_DSET(devAoDAC128V, DevAoDac128v::init)

}  // namespace mpf
