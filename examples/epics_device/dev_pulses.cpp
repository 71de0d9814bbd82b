// SPDX-License-Identifier: MIT
// Device support of the pulse counter server, examples/own_device.
//
//   longin  "Pulse counter"  INP "#C<location> S<channel> @<server>": reads the pulses
//   bo      "Pulse counter"  OUT "#C<location> S<channel> @<server>": 1 clears the channel
#include <boRecord.h>
#include <longinRecord.h>

#include <mpf/epics/dev_mpf.h>

namespace {

enum Command : std::int32_t { kRead = 0, kClear = 1 };  // of the server

// The reply of the server if it has done what was requested, else nullptr.
const mpf::Int32* success(const mpf::Message& message) {
  const auto* reply = message.tryAs<mpf::Int32>();
  return reply != nullptr && reply->status == 0 ? reply : nullptr;
}

class DevLonginPulses final : public mpf::DevMpf {
 public:
  explicit DevLonginPulses(longinRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->inp) {}
  long startIO(dbCommon*) override {
    return sendReply(mpf::Int32Message({.cmd = kRead, .address = getSignal()}));
  }
  long completeIO(dbCommon* record, mpf::Message&& message) override {
    const auto* reply = success(message);
    if (reply == nullptr) return fail(record, "no such channel, or no module");
    reinterpret_cast<longinRecord*>(record)->val = reply->value;
    record->udf = FALSE;
    return MPF_OK;
  }
  static long init(dbCommon* record) {
    return mpf::bindDevice<DevLonginPulses>(reinterpret_cast<longinRecord*>(record));
  }
};

class DevBoClearPulses final : public mpf::DevMpf {
 public:
  explicit DevBoClearPulses(boRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {}
  long startIO(dbCommon* record) override {
    if (reinterpret_cast<boRecord*>(record)->val == 0) return MPF_OK;
    return sendReply(mpf::Int32Message({.cmd = kClear, .address = getSignal()}));
  }
  long completeIO(dbCommon* record, mpf::Message&& message) override {
    return success(message) != nullptr ? MPF_OK : fail(record, "no such channel, or no module");
  }
  // MPF_NoConvert keeps the VAL of the database: there is no RVAL to convert.
  static long init(dbCommon* record) {
    const auto status = mpf::bindDevice<DevBoClearPulses>(reinterpret_cast<boRecord*>(record));
    return status == 0 ? MPF_NoConvert : status;
  }
};

}  // namespace

MAKE_DSET(devLonginPulses, DevLonginPulses::init)
MAKE_DSET(devBoClearPulses, DevBoClearPulses::init)
