// SPDX-License-Identifier: MIT
#include "tests/epics/mbbi_direct/scripted_device.h"

#include <atomic>
#include <registryDeviceSupport.h>

namespace mpf::test {
namespace {

ScriptedDevice device;

long report(int /*level*/) {
  ++device.reports;
  return 0;
}
long init(int isAfterRecords) {
  if (device.inits.empty()) scanIoInit(&device.scan);
  device.inits.push_back(isAfterRecords);
  return 0;
}
long initRecord(dbCommon* common) {
  auto& record = *reinterpret_cast<mbbiDirectRecord*>(common);
  ++device.recordInits;
  device.maskAtInit = record.mask;
  record.rval = device.raw;
  if (device.shift != 0) record.shft = device.shift;
  return 0;
}
long getIoIntInfo(int cmd, dbCommon* /*record*/, IOSCANPVT* scan) {
  device.interrupts.push_back(cmd);
  *scan = device.scan;
  return 0;
}
long read(mbbiDirectRecord* record) {
  ++std::atomic_ref(device.reads);  // records of several threads are locked one by one
  record->rval = device.raw;
  if (device.isSlow) record->pact = TRUE;
  return device.status;
}

mbbidirectdset scripted{{5, report, init, initRecord, getIoIntInfo}, read};
mbbidirectdset withoutInit{{5, nullptr, nullptr, nullptr, nullptr}, read};
mbbidirectdset withoutRead{{5, nullptr, nullptr, nullptr, nullptr}, nullptr};

}  // namespace

const char* const ScriptedDevice::kDatabase = R"(
  device(mbbiDirect, CONSTANT, devScripted, "Scripted")
  device(mbbiDirect, CONSTANT, devWithoutInit, "Without init_record")
  device(mbbiDirect, CONSTANT, devWithoutRead, "Without read")
  device(mbbiDirect, CONSTANT, devWithoutTable, "Without table")
)";

ScriptedDevice& ScriptedDevice::install() {
  device = {};
  registryDeviceSupportAdd("devScripted", &scripted.common);
  registryDeviceSupportAdd("devWithoutInit", &withoutInit.common);
  registryDeviceSupportAdd("devWithoutRead", &withoutRead.common);
  return device;
}

}  // namespace mpf::test
