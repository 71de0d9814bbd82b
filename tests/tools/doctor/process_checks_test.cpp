// SPDX-License-Identifier: MIT
// The checks of limits, /proc and priorities, on a host of the test.
#include "tests/tools/doctor/doctor_fixture.h"

namespace mpf::tools {
namespace {

class ProcessChecks : public test::DoctorHostTest {};

TEST_F(ProcessChecks, AHiddenProcIsAWarning) {
  write("proc/self/mounts", "proc /proc proc rw,hidepid=invisible 0 0\n");
  expect(checkHidepid(host_), Health::warning, "hidepid=invisible", "hidepid=0");
  write("proc/self/mounts", "proc /proc proc rw,hidepid=0 0 0\n");
  expect(checkHidepid(host_), Health::ok, "all users");
}

TEST_F(ProcessChecks, AKernelWithoutPidfdIsAWarning) {
  host_.hasPidfd = [] { return false; };
  write("proc/sys/kernel/osrelease", "4.19.0\n");
  expect(checkPidfd(host_), Health::warning, "kernel 4.19.0 has no pidfd_open", "5.3");
}

TEST_F(ProcessChecks, TightLimitsAreWarnings) {
  write("proc/self/limits",
        "Max open files            256                  524288               files     \n"
        "Max address space         1073741824           unlimited            bytes     \n");
  write("proc/sys/vm/max_map_count", "1000\n");
  write("proc/sys/fs/inotify/max_user_instances", "8\n");
  expect(checkOpenFiles(host_), Health::warning, "256: a program needs", "ulimit -n");
  expect(checkAddressSpace(host_), Health::warning, "1073741824", "ulimit -v");
  expect(checkMaps(host_), Health::warning, "1000", "vm.max_map_count");
  expect(checkInotify(host_), Health::warning, "8", "max_user_instances");
}

TEST_F(ProcessChecks, RealTimePriorityNeedsALimitOrACapability) {
  expect(checkRealTime(host_), Health::ok, "up to 20 by RLIMIT_RTPRIO");
  write("proc/self/limits",
        "Max realtime priority     0                    0                    \n");
  expect(checkRealTime(host_), Health::warning, "may have priority 0, device servers request 20",
         "LimitRTPRIO=20");
  append("proc/self/status", "CapEff:\t0000000000800000\n");
  expect(checkRealTime(host_), Health::ok, "CAP_SYS_NICE");
  write("proc/sys/kernel/sched_rt_runtime_us", "0\n");
  expect(checkRealTime(host_), Health::warning, "no processor time", "sched_rt_runtime_us=950000");
}

TEST_F(ProcessChecks, LimitsThatAreNotNumbersAreUnknown) {
  write("proc/self/limits", "Max open files            many\n");
  write("proc/sys/vm/max_map_count", "-1\n");
  expect(checkOpenFiles(host_), Health::unknown, "cannot be read");
  expect(checkAddressSpace(host_), Health::unknown, "cannot be read");
  expect(checkMaps(host_), Health::unknown, "cannot be read");
}

}  // namespace
}  // namespace mpf::tools
