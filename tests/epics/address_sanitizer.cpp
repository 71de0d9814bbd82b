// SPDX-License-Identifier: MIT
// What the tests of this folder need under AddressSanitizer.
#include <cstdlib>

// EPICS Base never frees some memory of an IOC, for example that of scanIoInit().
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __lsan_default_suppressions() {  // NOLINT
  return "leak:libCom.so\nleak:libdbCore.so\nleak:libdbRecStd.so\n";
}

#ifdef __SANITIZE_ADDRESS__
namespace {

// The allocator of AddressSanitizer has spin locks. A thread of an IOC that waits for one at a high
// real-time priority keeps the processor from the thread that holds it, and from all other IOCs:
// they hang forever.
[[maybe_unused]] const int areIocThreadsOrdinary =
    ::setenv("EPICS_ALLOW_POSIX_THREAD_PRIORITY_SCHEDULING", "NO", 1);

}  // namespace
#endif
