// SPDX-License-Identifier: MIT
// What AddressSanitizer does not report: EPICS Base never frees some memory of an IOC, for example
// that of scanIoInit().
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __lsan_default_suppressions() {  // NOLINT
  return "leak:libCom.so\nleak:libdbCore.so\nleak:libdbRecStd.so\n";
}
