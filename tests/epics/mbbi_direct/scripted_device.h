// SPDX-License-Identifier: MIT
// ScriptedDevice: device support for mbbiDirect records, DTYP "Scripted", that does what the test
// says and counts the calls.
//
//   auto& device = ScriptedDevice::install();
//   device.raw = 5;
//   const Ioc ioc(std::string(ScriptedDevice::kDatabase) +
//                 R"(record(mbbiDirect, "d") { field(DTYP, "Scripted") })");
//
// There is one device for all records. Threads: any, with the record locked, as device support.
#pragma once

#include <dbScan.h>
#include <mbbiDirectRecord.h>
#include <vector>

namespace mpf::test {

struct ScriptedDevice {
  // Declares the DTYPs "Scripted", "Without init_record", "Without read" and "Without table".
  static const char* const kDatabase;

  // Resets the device and makes it known to the next IOC.
  static ScriptedDevice& install();

  // ---- what the routines do
  long status = 0;  // that read_mbbiDirect returns
  epicsUInt32 raw = 0;  // RVAL after read_mbbiDirect and init_record
  epicsUInt16 shift = 0;  // SHFT after init_record
  bool isSlow = false;  // read_mbbiDirect sets PACT

  // ---- which calls they got
  int reports = 0;
  std::vector<int> inits;  // the argument of each call
  int recordInits = 0;
  epicsUInt32 maskAtInit = 0;  // MASK when init_record was called
  std::vector<int> interrupts;  // the argument cmd of each call of get_ioint_info
  int reads = 0;
  IOSCANPVT scan = nullptr;  // processes the records with SCAN "I/O Intr"
};

}  // namespace mpf::test
