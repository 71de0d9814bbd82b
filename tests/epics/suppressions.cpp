// SPDX-License-Identifier: MIT
// What the sanitizers do not report: EPICS Base never frees some memory of an IOC, for example that
// of scanIoInit(), and locks records in an order that depends on their addresses.
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __lsan_default_suppressions() {  // NOLINT
  return "leak:libCom.so\nleak:libdbCore.so\nleak:libdbRecStd.so\n";
}
extern "C" const char* __tsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __tsan_default_suppressions() {  // NOLINT
  return "deadlock:libCom.so\ndeadlock:libdbCore.so\n";
}
