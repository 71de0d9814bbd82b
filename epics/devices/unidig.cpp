// SPDX-License-Identifier: MIT
// Device support of a GreenSpring IP-Unidig: DTYP "Greenspring IP-Unidig".
//
//   longin  INP "#C<location> S0 @<module>In"        all inputs; subscribes when it processes
//   bi      INP "#C0 S<bit> @<name of the longin>"   SCAN "I/O Intr": one bit of that record
//   bo      OUT "#C<location> S<bit> @<module>Out"   one output
//
// Source  the EPICS module ipUnidig.
#include <alarm.h>
#include <biRecord.h>
#include <boRecord.h>
#include <dbAccess.h>
#include <dbStaticLib.h>
#include <errlog.h>
#include <longinRecord.h>
#include <recGbl.h>

#include <mpf/digital_io_commands.h>
#include <mpf/epics/dev_mpf.h>

namespace mpf {
namespace {

constexpr int kBits = 24;

// The server sends the inputs when the monitor starts, and at each change.
class DevLiUnidig final : public DevMpf {
 public:
  explicit DevLiUnidig(longinRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->inp, true) {}
  long startIO(dbCommon*) override {
    return sendReply(Int32Message({.cmd = digital::cmdStartMonitor}));
  }
  long completeIO(dbCommon* common, Message&& message) override {
    auto* record = reinterpret_cast<longinRecord*>(common);
    const auto* reply = message.tryAs<Int32>();
    long status = MPF_OK;
    if (reply == nullptr) {
      status = fail(common, "the reply is not an Int32 message");
    } else if (reply->status != 0) {
      status = fail(common, "the server cannot read the inputs");
    } else {
      record->val = reply->value;
      record->udf = FALSE;
    }
    scanIoRequest(ioScan());
    return status;
  }
  void connectIO(dbCommon* record, const Connect& connect) override {
    DevMpf::connectIO(record, connect);
    if (connect.status != ConnectStatus::connectYes) scanIoRequest(ioScan());
  }
  static long init(dbCommon* record) {
    return bindDevice<DevLiUnidig>(reinterpret_cast<longinRecord*>(record));
  }
};

class DevBoUnidig final : public DevMpf {
 public:
  explicit DevBoUnidig(boRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {
    if (getSignal() >= 0 && getSignal() < kBits) return;
    errlogPrintf("%s: OUT: bit %d: use 0 to %d\n", record->name, getSignal(), kBits - 1);
    setStatus(S_db_badField);
    record->pact = TRUE;  // the record never processes
  }
  long startIO(dbCommon* common) override {
    const auto* record = reinterpret_cast<boRecord*>(common);
    return sendReply(
        Int32Message({.cmd = record->val != 0 ? digital::cmdSetBits : digital::cmdClearBits,
                      .address = 1 << getSignal()}));
  }
  long completeIO(dbCommon* record, Message&& message) override {
    const auto* reply = message.tryAs<Int32>();
    if (reply == nullptr) return fail(record, "the reply is not an Int32 message");
    if (reply->status != 0) return fail(record, "the server cannot write the output");
    return MPF_OK;
  }
  // MPF_NoConvert keeps the VAL of the database: the output is not read back.
  static long init(dbCommon* record) {
    const auto status = bindDevice<DevBoUnidig>(reinterpret_cast<boRecord*>(record));
    return status == 0 ? MPF_NoConvert : status;
  }
};

// ---- bi: reads the longin record in the IOC; it sends no message

struct InputBit {
  longinRecord* inputs = nullptr;
  epicsUInt32 mask = 0;
};

longinRecord* findLongin(const std::string& name) {
  DBADDR address;
  if (dbNameToAddr(name.c_str(), &address) != 0) return nullptr;
  const bool isLongin = std::string(address.precord->rdes->name) == "longin";
  return isLongin ? reinterpret_cast<longinRecord*>(address.precord) : nullptr;
}

long initBit(dbCommon* common) {
  auto* record = reinterpret_cast<biRecord*>(common);
  const int bit = record->inp.type == VME_IO ? record->inp.value.vmeio.signal : -1;
  auto* inputs = bit >= 0 ? findLongin(record->inp.value.vmeio.parm) : nullptr;
  if (inputs == nullptr || bit >= kBits) {
    errlogPrintf("%s: INP: use #C0 S<bit 0 to %d> @<name of a longin record>\n", record->name,
                 kBits - 1);
    record->pact = TRUE;
    return S_db_badField;
  }
  record->mask = epicsUInt32{1} << bit;
  record->dpvt = new InputBit{inputs, record->mask};
  return 0;
}

long readBit(dbCommon* common) {
  auto* record = reinterpret_cast<biRecord*>(common);
  const auto* bit = static_cast<const InputBit*>(record->dpvt);
  if (bit == nullptr) return S_dev_noDevSup;
  if (bit->inputs->sevr == INVALID_ALARM) {
    recGblSetSevrMsg(record, bit->inputs->stat, INVALID_ALARM, "%s", bit->inputs->amsg);
    return -1;
  }
  record->rval = static_cast<epicsUInt32>(bit->inputs->val) & bit->mask;
  record->udf = FALSE;
  return 0;
}

long scanOfBit(int detach, dbCommon* common, IOSCANPVT* scan) {
  const auto* bit = static_cast<const InputBit*>(common->dpvt);
  if (bit == nullptr) return S_dev_noDevSup;
  return DevMpf::getIoIntInfo(detach, reinterpret_cast<dbCommon*>(bit->inputs), scan);
}

MpfDset devBiUnidig{{5, nullptr, nullptr, initBit, scanOfBit}, readBit, nullptr};

}  // namespace

extern "C" {
epicsExportAddress(dset, devBiUnidig);
}
MAKE_DSET(devLiUnidig, DevLiUnidig::init)
MAKE_DSET(devBoUnidig, DevBoUnidig::init)

}  // namespace mpf
