// SPDX-License-Identifier: MIT
// Every result of every check of `mpf doctor`, on a host made of files in a temporary folder.
#include "tools/doctor/checks.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "shm/layout.h"
#include "shm/segment.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/tools/report/router_rows.h"

namespace mpf::tools {
namespace {

using testing::AllOf;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;

// A host without problems, until a test changes it.
class DoctorChecks : public testing::Test {
 protected:
  DoctorChecks() {
    host_.root = folder_.path();
    host_.sharedMemory = [] { return Host::Space{8 * kGiB, 7 * kGiB, 1'000'000, 2'000'000}; };
    host_.hasPidfd = [] { return true; };
    write("proc/self/mounts",
          "proc /proc proc rw,relatime 0 0\ntmpfs /dev/shm tmpfs rw,nosuid,size=8388608k 0 0\n");
    write("proc/self/status",
          "Name:\tmpf\nUid:\t4711 4711 4711 4711\nGid:\t4711 4711 4711 4711\nGroups:\t4711 20 "
          "\nCpus_allowed_list:\t0-3,8\n");
    write("proc/self/limits",
          "Limit                     Soft Limit           Hard Limit           Units     \n"
          "Max open files            4096                 524288               files     \n"
          "Max address space         unlimited            unlimited            bytes     \n"
          "Max realtime priority     20                   20                   \n");
    write("proc/self/cgroup", "0::/user.slice/lab.service\n");
    write("proc/self/ns/pid", "");
    write("proc/sys/kernel/osrelease", "6.1.0-18-amd64\n");
    write("proc/sys/vm/max_map_count", "65530\n");
    write("proc/sys/fs/inotify/max_user_instances", "128\n");
    write("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
    write("sys/devices/system/clocksource/clocksource0/available_clocksource",
          "tsc hpet acpi_pm\n");
    write("sys/devices/system/cpu/cpufreq/policy0/scaling_governor", "performance\n");
    write("sys/devices/system/cpu/cpufreq/policy1/scaling_governor", "performance\n");
    std::filesystem::create_directories(host_.root / "dev/shm");
    chmod("dev/shm", 01777);
  }

  void write(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories((host_.root / path).parent_path());
    std::ofstream(host_.root / path) << text;
  }
  void append(const std::string& path, const std::string& text) const {
    std::ofstream(host_.root / path, std::ios::app) << text;
  }
  void remove(const std::string& path) const { std::filesystem::remove_all(host_.root / path); }
  void chmod(const std::string& path, mode_t mode) const {
    ASSERT_EQ(::chmod((host_.root / path).c_str(), mode), 0);
  }
  // Creates a segment that belongs to the user of the test. According to the files of this host,
  // the program runs as user 4711.
  void leave(const std::string& name, mode_t mode) const {
    write("dev/shm/" + name, "");
    chmod("dev/shm/" + name, mode);
  }
  // Creates a server window of a process of that pid namespace.
  void leaveWindow(const std::string& server, std::uint64_t pidNamespace) const {
    layout::SegmentHeader header{};
    header.pidNamespace = pidNamespace;
    std::string bytes(sizeof header, '\0');
    std::memcpy(bytes.data(), &header, sizeof header);
    write("dev/shm/mpf.lab.s.0." + server, bytes);
  }
  [[nodiscard]] std::uint64_t ownNamespace() const {
    struct stat status{};
    EXPECT_EQ(::stat((host_.root / "proc/self/ns/pid").c_str(), &status), 0);
    return status.st_ino;
  }

  static void expect(const Finding& finding, Health health, const std::string& seen,
                     const std::string& remedy = "") {
    EXPECT_STREQ(toString(finding.health), toString(health))
        << finding.check << ": " << finding.seen;
    EXPECT_THAT(finding.seen, HasSubstr(seen)) << finding.check;
    if (remedy.empty()) EXPECT_EQ(finding.remedy, "") << finding.check;
    else EXPECT_THAT(finding.remedy, HasSubstr(remedy)) << finding.check;
  }

  test::TemporaryFolder folder_;
  Host host_;
};

TEST_F(DoctorChecks, FindsNoProblemOnAGoodHost) {
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
TEST_F(DoctorChecks, ReportsUnknownWhereAHostShowsNothing) {
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

TEST_F(DoctorChecks, AReadOnlyMountIsAProblem) {
  append("proc/self/mounts", "tmpfs /dev/shm tmpfs ro,nosuid 0 0\n");
  expect(checkMount(host_), Health::problem, "read-only", "remount,rw");
}

TEST_F(DoctorChecks, AMountOfAnotherTypeOrNoneIsAWarning) {
  write("proc/self/mounts", "overlay /dev/shm overlay rw 0 0\n");
  expect(checkMount(host_), Health::warning, "overlay, not tmpfs", "mount -t tmpfs");
  write("proc/self/mounts", "proc /proc proc rw 0 0\n");
  expect(checkMount(host_), Health::warning, "not a file system of its own", "mount -t tmpfs");
}

TEST_F(DoctorChecks, LittleSpaceIsAWarningAndNoSpaceAProblem) {
  host_.sharedMemory = [] { return Host::Space{64 << 20, 60 << 20, 1'000'000, 2'000'000}; };
  expect(checkSpace(host_), Health::warning, "60.0 MiB of 64.0 MiB free: the small default",
         "--shm-size");
  host_.sharedMemory = [] { return Host::Space{8 * kGiB, 5 << 20, 1'000'000, 2'000'000}; };
  expect(checkSpace(host_), Health::warning, "5.0 MiB of 8.0 GiB free: large messages",
         "mpf clean");
  host_.sharedMemory = [] { return Host::Space{8 * kGiB, 7 * kGiB, 500, 2'000'000}; };
  expect(checkSpace(host_), Health::warning, "500 of 2000000 inodes free", "nr_inodes");
  host_.sharedMemory = [] { return Host::Space{8 * kGiB, 4096, 1'000'000, 2'000'000}; };
  expect(checkSpace(host_), Health::problem,
         "4.0 KiB of 8.0 GiB free: links and servers are refused", "mpf clean");
  host_.sharedMemory = [] { return Host::Space{8 * kGiB, kGiB, 3, 800}; };
  expect(checkSpace(host_), Health::problem, "3 of 800 inodes free", "nr_inodes=");
}

TEST_F(DoctorChecks, SharedMemoryMustBeWritableByAllAndSticky) {
  chmod("dev/shm", 0777);
  expect(checkRights(host_), Health::warning, "mode 0777: any user may remove", "chmod 1777");
  chmod("dev/shm", 0755);
  expect(checkRights(host_), Health::problem, "mode 0755: not every user may create", "chmod 1777");
  remove("dev/shm");
  expect(checkRights(host_), Health::problem, "/dev/shm does not exist", "mkdir");
}

TEST_F(DoctorChecks, CountsSegmentsThatThisUserMayNotRead) {
  leave("mpf.lab.s.0.dac", 0644);
  leave("mpf.lab.h.1", 0600);
  leave("notes", 0600);
  if (::geteuid() == 4711) GTEST_SKIP() << "the files belong to this user";

  expect(checkSegments(host_), Health::warning, "this user may not read 1 of 2 files", "--group");

  write("proc/self/status", "Uid:\t0 0 0 0\nGid:\t0 0 0 0\nGroups:\t\n");
  expect(checkSegments(host_), Health::ok, "2 files");
}

TEST_F(DoctorChecks, AcceptsSegmentsThatTheGroupMayRead) {
  leave("mpf.lab.h.1", 0660);
  write("proc/self/status",
        "Uid:\t4711 4711 4711 4711\nGid:\t" + std::to_string(::getegid()) + " 1 1 1\n");

  expect(checkSegments(host_), Health::ok, "1 files");
}

TEST_F(DoctorChecks, CountsWindowsOfAnotherPidNamespace) {
  leaveWindow("here", ownNamespace());
  leaveWindow("there", ownNamespace() + 1);
  write("dev/shm/mpf.lab.c.1", "cut");
  expect(checkNamespaces(host_), Health::warning, "1 of 2 windows", "--pid=host");
  remove("dev/shm/mpf.lab.s.0.there");
  expect(checkNamespaces(host_), Health::ok, "1 windows");
}

class RemoveIpc : public DoctorChecks {
 protected:
  void SetUp() override { write("run/systemd/system/.keep", ""); }
};

TEST_F(RemoveIpc, IsAProblemForALoginUserUnlessSwitchedOff) {
  expect(checkRemoveIpc(host_), Health::problem, "RemoveIPC=yes: when user 4711 logs out",
         "enable-linger 4711");
  write("etc/systemd/logind.conf", "[Login]\n#RemoveIPC=no\n");
  expect(checkRemoveIpc(host_), Health::problem, "RemoveIPC=yes", "RemoveIPC=no under [Login]");
  write("etc/systemd/logind.conf", "[Login]\nRemoveIPC = no\n");
  expect(checkRemoveIpc(host_), Health::ok, "RemoveIPC=no");
}

TEST_F(RemoveIpc, IsTheValueOfTheLastFile) {
  write("etc/systemd/logind.conf", "[Login]\nRemoveIPC=yes\n");
  write("usr/lib/systemd/logind.conf.d/20-site.conf", "[Login]\nRemoveIPC=no\n");
  expect(checkRemoveIpc(host_), Health::ok, "RemoveIPC=no");
  write("etc/systemd/logind.conf.d/10-early.conf", "[Login]\nRemoveIPC=yes\n");
  expect(checkRemoveIpc(host_), Health::ok, "RemoveIPC=no");
  write("etc/systemd/logind.conf.d/20-site.conf", "[Login]\n");
  expect(checkRemoveIpc(host_), Health::problem, "RemoveIPC=yes", "mpf.conf");
}

TEST_F(RemoveIpc, DoesNotApplyToSystemUsers) {
  write("proc/self/status", "Uid:\t0 100 0 0\n");
  expect(checkRemoveIpc(host_), Health::ok, "excepts users below 1000");
}

TEST_F(DoctorChecks, AHiddenProcIsAWarning) {
  write("proc/self/mounts", "proc /proc proc rw,hidepid=invisible 0 0\n");
  expect(checkHidepid(host_), Health::warning, "hidepid=invisible", "hidepid=0");
  write("proc/self/mounts", "proc /proc proc rw,hidepid=0 0 0\n");
  expect(checkHidepid(host_), Health::ok, "all users");
}

TEST_F(DoctorChecks, AKernelWithoutPidfdIsAWarning) {
  host_.hasPidfd = [] { return false; };
  write("proc/sys/kernel/osrelease", "4.19.0\n");
  expect(checkPidfd(host_), Health::warning, "kernel 4.19.0 has no pidfd_open", "5.3");
}

TEST_F(DoctorChecks, TightLimitsAreWarnings) {
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

TEST_F(DoctorChecks, RealTimePriorityNeedsALimitOrACapability) {
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

TEST_F(DoctorChecks, LimitsThatAreNotNumbersAreUnknown) {
  write("proc/self/limits", "Max open files            many\n");
  write("proc/sys/vm/max_map_count", "-1\n");
  expect(checkOpenFiles(host_), Health::unknown, "cannot be read");
  expect(checkAddressSpace(host_), Health::unknown, "cannot be read");
  expect(checkMaps(host_), Health::unknown, "cannot be read");
}

TEST_F(DoctorChecks, OneProcessorIsAWarning) {
  expect(checkCpus(host_), Health::ok, "5 allowed");
  write("proc/self/status", "Cpus_allowed_list:\t7\n");
  expect(checkCpus(host_), Health::warning, "1 allowed", "--wait-mode block");
  write("proc/self/status", "Cpus_allowed_list:\t3-1\n");
  expect(checkCpus(host_), Health::unknown, "cannot be read");
}

TEST_F(DoctorChecks, AQuotaBelowTwoProcessorsIsAWarning) {
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

TEST_F(DoctorChecks, ASlowClockIsAWarning) {
  const std::string folder = "sys/devices/system/clocksource/clocksource0/";
  write(folder + "current_clocksource", "hpet\n");
  expect(checkClock(host_), Health::warning, "hpet: reading", "clocksource=tsc");
  write(folder + "available_clocksource", "hpet acpi_pm\n");
  expect(checkClock(host_), Health::warning, "hpet", "clocks available here: hpet acpi_pm");
  write(folder + "current_clocksource", "kvm-clock\n");
  expect(checkClock(host_), Health::ok, "kvm-clock");
}

TEST_F(DoctorChecks, APowerSavingGovernorIsAWarning) {
  write("sys/devices/system/cpu/cpufreq/policy1/scaling_governor", "schedutil\n");
  expect(checkGovernor(host_), Health::warning, "performance, schedutil", "cpupower");
  remove("sys/devices/system/cpu/cpufreq");
  expect(checkGovernor(host_), Health::unknown, "virtual machines");
}

// Copies the segment of a router to that host. The returned file holds its lock.
FileDescriptor leaveRouter(const std::filesystem::path& folder, const Backplane& backplane) {
  const auto name = backplane.segmentNames().at(0);
  std::filesystem::copy_file(segments::path(name), folder / name,
                             std::filesystem::copy_options::overwrite_existing);
  FileDescriptor file(checkCall(::open((folder / name).c_str(), O_RDWR | O_CLOEXEC), "open", name));
  struct flock lock{};
  lock.l_type = F_WRLCK;
  checkCall(::fcntl(file.get(), F_OFD_SETLK, &lock), "lock", name);
  return file;
}

TEST_F(DoctorChecks, ARemoteThatIsUnreachableForLongIsAWarning) {
  const test::TestBackplane backplane;
  router::Statistics statistics(backplane, "lab1");
  const auto folder = host_.root / "dev/shm";
  expect(checkRouters(host_), Health::ok, "none");

  const auto remote = test::connectedRemote(statistics, {1});
  const auto caller = test::connectedCaller(statistics);
  const auto lost = test::lostRemote(statistics);
  auto router = leaveRouter(folder, backplane);
  expect(checkRouters(host_), Health::ok, "2 remotes, 1 caller");

  constexpr std::uint64_t kFiveMinutesNs = 300'000'000'000;
  test::set((*lost)->sinceNs, static_cast<std::uint64_t>(Clock::nowNs()) - kFiveMinutesNs);
  router.reset();
  router = leaveRouter(folder, backplane);
  expect(
      checkRouters(host_), Health::warning,
      "1 of 2 remotes cannot be reached: 10.0.0.8:9900, for 5 min: connect(): Connection refused",
      "mpf-router runs there");

  router.reset();
  expect(checkRouters(host_), Health::ok, "none");
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

}  // namespace
}  // namespace mpf::tools
