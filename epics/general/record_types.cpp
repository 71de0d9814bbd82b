// SPDX-License-Identifier: MIT
// The device support tables of DTYP "MPF": one line for each record type.
#include <dbAccess.h>
#include <dbStaticLib.h>
#include <optional>
#include <vector>

#include "epics/general/general_device.h"
#include "epics/general/record_fields.h"

namespace mpf {
namespace {

// ---- the link and the type of messages of a record type

template <class Record>
DBLINK* linkOf(Record& record) {
  if constexpr (requires { record.inp; }) return &record.inp;
  else return &record.out;
}

template <class Record>
MessageType typeOf(const dbCommon* common) {
  const auto& record = *reinterpret_cast<const Record*>(common);
  if constexpr (requires { record.bptr; }) return messageTypeOf(record.ftvl);
  else if constexpr (std::is_same_v<decltype(record.val), epicsFloat64>)
    return MessageType::float64;
  else if constexpr (std::is_arithmetic_v<decltype(record.val)> ||
                     std::is_same_v<Record, eventRecord>)
    return MessageType::int32;
  else return MessageType::char8Array;
}

template <class Record>
constexpr bool kIsOutput = requires(Record record) { record.out; };

template <class Record>
constexpr bool kCanHaveBits =
    requires(Record record) { record.rval; } || std::is_integral_v<decltype(Record::val)>;

template <class Record>
constexpr bool kCanHaveRange = requires(Record record) { record.eslo; };

template <class Record>
bool isSmoothed(const dbCommon* common) {
  if constexpr (requires(Record record) { record.smoo; })
    return reinterpret_cast<const Record*>(common)->smoo != 0;
  else return false;
}

template <class Record>
constexpr RecordAccess accessOf() {
  RecordAccess access{
      .type = typeOf<Record>,
      .canHaveBits = kCanHaveBits<Record>,
      .canHaveRange = kCanHaveRange<Record>,
      .prepare =
          [](dbCommon* record, const LinkOptions& options) {
            fields::prepare(*reinterpret_cast<Record*>(record), options);
          },
      .store =
          [](dbCommon* record, const MessageValue& value, const LinkOptions& options) {
            return fields::store(*reinterpret_cast<Record*>(record), value, options);
          },
      .load = nullptr,
      .outputMode = nullptr,
      .isSmoothed = isSmoothed<Record>};
  if constexpr (kIsOutput<Record>) {
    access.load = [](const dbCommon* record, const LinkOptions& options,
                     std::vector<double>& scratch) -> std::optional<MessageValue> {
      return fields::load(*reinterpret_cast<const Record*>(record), options, scratch);
    };
    access.outputMode = [](dbCommon* record) { return &reinterpret_cast<Record*>(record)->omsl; };
  }
  return access;
}

// ---- init_record()

template <class Record>
long init(dbCommon* common) {
  static constexpr auto kAccess = accessOf<Record>();
  auto& record = *reinterpret_cast<Record*>(common);
  // Base calls the support of aai in the first pass already, in which links are not parsed yet.
  if constexpr (std::is_same_v<Record, aaiRecord>)
    if (record.bptr == nullptr) return AAI_DEVINIT_PASS1;
  const auto status = GeneralDevice::init(common, linkOf(record), kAccess);
  // MPF_NoConvert: RVAL of an output is not known, and VAL of the database is kept.
  constexpr bool kIsRawOutput = kIsOutput<Record> && requires { record.rval; };
  return status == 0 && kIsRawOutput ? MPF_NoConvert : status;
}

// Base calls the support of aao in the first pass only: the records are kept until all records are
// initialised.
std::vector<dbCommon*>& waitingAaoRecords() {
  static std::vector<dbCommon*> records;
  return records;
}
long keepAao(dbCommon* record) {
  waitingAaoRecords().push_back(record);
  return 0;
}
long initAao(int isAfterRecords) {
  if (isAfterRecords == 0) return 0;
  for (auto* record : waitingAaoRecords()) static_cast<void>(init<aaoRecord>(record));
  waitingAaoRecords().clear();
  return 0;
}
MpfDset devAaoMpf{{5, nullptr, initAao, keepAao, DevMpf::getIoIntInfo}, DevMpf::readWrite, nullptr};

}  // namespace

extern "C" {
epicsExportAddress(dset, devAaoMpf);
}
MAKE_LINCONV_DSET(devAiMpf, init<aiRecord>)
MAKE_LINCONV_DSET(devAoMpf, init<aoRecord>)
MAKE_DSET(devLonginMpf, init<longinRecord>)
MAKE_DSET(devLongoutMpf, init<longoutRecord>)
MAKE_DSET(devInt64inMpf, init<int64inRecord>)
MAKE_DSET(devInt64outMpf, init<int64outRecord>)
MAKE_DSET(devBiMpf, init<biRecord>)
MAKE_DSET(devBoMpf, init<boRecord>)
MAKE_DSET(devMbbiMpf, init<mbbiRecord>)
MAKE_DSET(devMbboMpf, init<mbboRecord>)
MAKE_DSET(devMbbiDirectMpf, init<mbbiDirectRecord>)
MAKE_DSET(devMbboDirectMpf, init<mbboDirectRecord>)
MAKE_DSET(devStringinMpf, init<stringinRecord>)
MAKE_DSET(devStringoutMpf, init<stringoutRecord>)
MAKE_DSET(devLsiMpf, init<lsiRecord>)
MAKE_DSET(devLsoMpf, init<lsoRecord>)
MAKE_DSET(devWaveformMpf, init<waveformRecord>)
MAKE_DSET(devAaiMpf, init<aaiRecord>)
MAKE_DSET(devEventMpf, init<eventRecord>)

}  // namespace mpf
