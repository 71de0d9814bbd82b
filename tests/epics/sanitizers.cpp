// SPDX-License-Identifier: MIT
// What the tests of this folder need under sanitizers.
#include <cstdlib>

#include "tests/support/sanitized.h"

// EPICS Base never frees some memory of an IOC, for example that of scanIoInit().
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __lsan_default_suppressions() {  // NOLINT
  return "leak:libCom.so\nleak:libdbCore.so\nleak:libdbRecStd.so\n";
}

// EPICS Base has flags and counters that its threads access without a lock, initialises what
// eventNameToHandle() uses without a barrier, and takes the locks of timer queues in both orders.
// race_top: the function that accesses the memory; races of MPF on threads of Base are reported.
extern "C" const char* __tsan_default_suppressions();  // NOLINT: the name is prescribed
extern "C" const char* __tsan_default_suppressions() {  // NOLINT
  return "race_top:libCom.so\nrace_top:libca.so\nrace_top:libdbCore.so\nrace_top:libdbRecStd.so\n"
         "race:eventNameToHandle\ndeadlock:timerQueueActiveMgr\n";
}

namespace {

// Sanitizers have spin locks. A thread of an IOC that waits for one at a high real-time priority
// keeps the processor from the thread that holds it, and from all other IOCs: they hang forever.
[[maybe_unused]] const int kAreIocThreadsOrdinary =
    mpf::test::kIsSanitized ? ::setenv("EPICS_ALLOW_POSIX_THREAD_PRIORITY_SCHEDULING", "NO", 1) : 0;

}  // namespace
