// SPDX-License-Identifier: MIT
// Device support of a GreenSpring IP-Unidig: DTYP "Greenspring IP-Unidig".
//
//   longin  INP "#C<location> S0 @<module>In"        all inputs; subscribes when it processes, with
//                                                    SCAN "I/O Intr" when the server connects, and
//                                                    when SCAN becomes "I/O Intr"
//   bi      INP "#C0 S<bit> @<name of the longin>"   SCAN "I/O Intr": one bit of that record
//   bo      OUT "#C<location> S<bit> @<module>Out"   one output
//
// Source  the EPICS module ipUnidig.
#include <alarm.h>
#include <biRecord.h>
#include <boRecord.h>
#include <callback.h>
#include <dbAccess.h>
#include <dbScan.h>
#include <dbStaticLib.h>
#include <fmt/format.h>
#include <longinRecord.h>
#include <mutex>
#include <recGbl.h>
#include <string>
#include <utility>

#include <mpf/digital_io_commands.h>
#include <mpf/epics/dev_mpf.h>

#include "epics/common_fields.h"

namespace mpf {
namespace {

constexpr int kBits = 24;

std::string whyNoBit(int bit) { return fmt::format("bit {}: use 0 to {}", bit, kBits - 1); }

// What the bi records need of their longin record, which has another lock.
struct InputState {
  epicsInt32 value = 0;
  epicsEnum16 severity = INVALID_ALARM;
  epicsEnum16 status = UDF_ALARM;
  std::string reason;
};

// The server sends the inputs when the monitor starts, and at each change.
class DevLiUnidig final : public DevMpf {
 public:
  explicit DevLiUnidig(longinRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->inp, true) {
    scanIoInit(&bits_);
  }
  static DevLiUnidig* of(const dbCommon* record) {
    return static_cast<DevLiUnidig*>(static_cast<DevMpf*>(record->dpvt));
  }
  InputState state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  // The scan list of the bi records. That of the longin itself is ioScan(), which nobody requests:
  // each message processes the record.
  IOSCANPVT bits() const noexcept { return bits_; }
  long startIO(dbCommon*) override {
    return sendReply(Int32Message({.cmd = digital::cmdStartMonitor}));
  }
  long completeIO(dbCommon* common, Message&& message) override {
    auto* record = reinterpret_cast<longinRecord*>(common);
    const auto* reply = message.tryAs<Int32>();
    if (reply == nullptr) return fail(common, "the reply is not an Int32 message");
    if (reply->status != 0) return fail(common, "the server cannot read the inputs");
    record->val = reply->value;
    record->udf = FALSE;
    return MPF_OK;
  }
  void connectIO(dbCommon* record, const Connect& connect) override {
    DevMpf::connectIO(record, connect);
    if (record->pact != FALSE) return;
    if (connect.status != ConnectStatus::connectYes) {
      publish(*record, {.severity = record->sevr, .status = record->stat, .reason = record->amsg});
    } else if (record->scan == SCAN_IO_EVENT) {
      dbProcess(record);
    }
  }
  static long init(dbCommon* record) {
    return bindDevice<DevLiUnidig>(reinterpret_cast<longinRecord*>(record));
  }
  // The entry of the device support table for SCAN "I/O Intr". A record that gets this SCAN while
  // the IOC runs processes soon, not now: the field is being written.
  static long ioScanOf(int isRemoved, dbCommon* record, IOSCANPVT* scan) {
    const auto status = getIoIntInfo(isRemoved, record, scan);
    if (status == 0 && isRemoved == 0 && interruptAccept != FALSE)
      callbackRequestProcessCallback(&of(record)->subscribe_, record->prio, record);
    return status;
  }
  // The entry of the device support table: its result, unless it waits for a reply, is that of the
  // bi records as well.
  static long read(dbCommon* record) {
    const bool wasActive = record->pact != FALSE;
    const auto status = readWrite(record);
    if (wasActive || record->pact == FALSE)
      of(record)->publish(
          *record, {.severity = record->nsev, .status = record->nsta, .reason = record->namsg});
    return status;
  }

 private:
  // Processes the bi records with this state.
  void publish(const dbCommon& record, InputState state) {
    state.value = reinterpret_cast<const longinRecord&>(record).val;
    {
      const std::lock_guard lock(mutex_);
      state_ = std::move(state);
    }
    scanIoRequest(bits_);
  }

  IOSCANPVT bits_ = nullptr;
  epicsCallback subscribe_{};
  mutable std::mutex mutex_;
  InputState state_;  // under mutex_
};

MpfDset devLiUnidig{
    {5, nullptr, nullptr, DevLiUnidig::init, DevLiUnidig::ioScanOf}, DevLiUnidig::read, nullptr};

class DevBoUnidig final : public DevMpf {
 public:
  explicit DevBoUnidig(boRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {
    if (getSignal() >= 0 && getSignal() < kBits) return;
    refuseLink(*this, reinterpret_cast<dbCommon*>(record), "OUT", whyNoBit(getSignal()).c_str());
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

// ---- bi: a bit of the longin record in the IOC; it sends no message

struct InputBit {
  dbCommon* inputs = nullptr;
  epicsUInt32 mask = 0;
};

// A longin record with the device support of this file; nullptr if the name is of another record.
dbCommon* findInputs(const std::string& name) {
  DBADDR address;
  if (dbNameToAddr(name.c_str(), &address) != 0) return nullptr;
  const bool isOurs = static_cast<const void*>(address.precord->dset) == &devLiUnidig;
  return isOurs ? address.precord : nullptr;
}

long initBit(dbCommon* common) {
  auto* record = reinterpret_cast<biRecord*>(common);
  const int bit = record->inp.type == VME_IO ? record->inp.value.vmeio.signal : -1;
  if (bit < 0 || bit >= kBits) {
    refuseLink(common, "INP", whyNoBit(bit).c_str());
    return S_db_badField;
  }
  const std::string name = record->inp.value.vmeio.parm;
  auto* inputs = findInputs(name);
  if (inputs == nullptr) {
    refuseLink(common, "INP",
               fmt::format("\"{}\" is not a longin record with DTYP \"Greenspring IP-Unidig\"; use "
                           "#C0 S<bit> @<name of the longin record>",
                           name)
                   .c_str());
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
  const auto inputs = DevLiUnidig::of(bit->inputs)->state();
  forgetReason(common);
  if (inputs.severity == INVALID_ALARM) {
    recGblSetSevrMsg(record, inputs.status, INVALID_ALARM, "%s", inputs.reason.c_str());
    return -1;
  }
  record->rval = static_cast<epicsUInt32>(inputs.value) & bit->mask;
  record->udf = FALSE;
  return 0;
}

long scanOfBit(int /*detach*/, dbCommon* common, IOSCANPVT* scan) {
  const auto* bit = static_cast<const InputBit*>(common->dpvt);
  if (bit == nullptr) return S_dev_noDevSup;
  *scan = DevLiUnidig::of(bit->inputs)->bits();
  return 0;
}

MpfDset devBiUnidig{{5, nullptr, nullptr, initBit, scanOfBit}, readBit, nullptr};

}  // namespace

extern "C" {
epicsExportAddress(dset, devLiUnidig);
epicsExportAddress(dset, devBiUnidig);
}
MAKE_DSET(devBoUnidig, DevBoUnidig::init)

}  // namespace mpf
