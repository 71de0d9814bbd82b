// SPDX-License-Identifier: MIT
// The checks of processors and clocks, and all checks of `mpf doctor` together.
#include "tests/tools/doctor/doctor_fixture.h"

namespace mpf::tools {
namespace {

using testing::AllOf;
using testing::Field;
using testing::IsEmpty;
using testing::Not;

class MachineChecks : public test::DoctorHostTest {};

TEST_F(MachineChecks, FindsNoProblemOnAGoodHost) {
  const auto findings = runDoctorChecks(host_);

  EXPECT_EQ(findings.size(), 18U);
  for (const auto& finding : findings) {
    EXPECT_STREQ(toString(finding.health), "ok") << finding.check << ": " << finding.seen;
    EXPECT_THAT(finding.check, Not(IsEmpty()));
    EXPECT_THAT(finding.seen, Not(IsEmpty())) << finding.check;
    EXPECT_THAT(finding.remedy, IsEmpty()) << finding.check;
  }
}

// No check throws or guesses where the host shows nothing.
TEST_F(MachineChecks, ReportsUnknownWhereAHostShowsNothing) {
  remove("proc");
  remove("sys");
  host_.sharedMemory = [] { return std::nullopt; };

  for (const auto& finding : runDoctorChecks(host_)) {
    const bool isKnown = finding.check == "rights of /dev/shm" ||
                         finding.check == "RemoveIPC of logind" || finding.check == "pidfd" ||
                         finding.check == "open files of servers" ||
                         finding.check == "connections of routers";
    EXPECT_STREQ(toString(finding.health), isKnown ? "ok" : "unknown")
        << finding.check << ": " << finding.seen;
  }
}

// On any real host, each check has a result, and a remedy exactly if it needs one.
TEST(DoctorChecksHere, HaveResultsOnTheRealHost) {
  for (const auto& finding : runDoctorChecks(Host())) {
    EXPECT_THAT(finding, AllOf(Field(&Finding::check, Not(IsEmpty())),
                               Field(&Finding::seen, Not(IsEmpty()))));
    const bool needsHelp = finding.health == Health::warning || finding.health == Health::problem;
    EXPECT_EQ(needsHelp, !finding.remedy.empty()) << finding.check;
  }
}

TEST_F(MachineChecks, OneProcessorIsAWarning) {
  expect(checkCpus(host_), Health::ok, "5 allowed");
  write("proc/self/status", "Cpus_allowed_list:\t7\n");
  expect(checkCpus(host_), Health::warning, "1 allowed", "--wait-mode block");
  write("proc/self/status", "Cpus_allowed_list:\t3-1\n");
  expect(checkCpus(host_), Health::unknown, "cannot be read");
}

TEST_F(MachineChecks, AQuotaBelowTwoProcessorsIsAWarning) {
  write("sys/fs/cgroup/user.slice/cpu.max", "150000 100000\n");
  write("sys/fs/cgroup/user.slice/lab.service/cpu.max", "max 100000\n");
  expect(checkCpus(host_), Health::warning, "5 allowed, time of 1.5", "CPUQuota");
  write("sys/fs/cgroup/user.slice/cpu.max", "400000 100000\n");
  expect(checkCpus(host_), Health::ok, "5 allowed, time of 4");
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "100000\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  expect(checkCpus(host_), Health::warning, "5 allowed, time of 1", "CPUQuota");
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  expect(checkCpus(host_), Health::ok, "time of 4");
}

TEST_F(MachineChecks, ASlowClockIsAWarning) {
  const std::string folder = "sys/devices/system/clocksource/clocksource0/";
  write(folder + "current_clocksource", "hpet\n");
  expect(checkClock(host_), Health::warning, "hpet: reading", "clocksource=tsc");
  write(folder + "available_clocksource", "hpet acpi_pm\n");
  expect(checkClock(host_), Health::warning, "hpet", "clocks available here: hpet acpi_pm");
  write(folder + "current_clocksource", "kvm-clock\n");
  expect(checkClock(host_), Health::ok, "kvm-clock");
}

TEST_F(MachineChecks, APowerSavingGovernorIsAWarning) {
  write("sys/devices/system/cpu/cpufreq/policy1/scaling_governor", "schedutil\n");
  expect(checkGovernor(host_), Health::warning, "performance, schedutil", "cpupower");
  remove("sys/devices/system/cpu/cpufreq");
  expect(checkGovernor(host_), Health::unknown, "virtual machines");
}

}  // namespace
}  // namespace mpf::tools
