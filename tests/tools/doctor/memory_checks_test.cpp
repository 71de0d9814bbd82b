// SPDX-License-Identifier: MIT
// The checks of shared memory, on a host of the test.
#include <unistd.h>

#include <cstring>

#include "shm/layout.h"
#include "tests/tools/doctor/doctor_fixture.h"

namespace mpf::tools {
namespace {

using test::kGiB;

class MemoryChecks : public test::DoctorHostTest {
 protected:
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
};

TEST_F(MemoryChecks, AReadOnlyMountIsAProblem) {
  append("proc/self/mounts", "tmpfs /dev/shm tmpfs ro,nosuid 0 0\n");
  expect(checkMount(host_), Health::problem, "read-only", "remount,rw");
}

TEST_F(MemoryChecks, AMountOfAnotherTypeOrNoneIsAWarning) {
  write("proc/self/mounts", "overlay /dev/shm overlay rw 0 0\n");
  expect(checkMount(host_), Health::warning, "overlay, not tmpfs", "mount -t tmpfs");
  write("proc/self/mounts", "proc /proc proc rw 0 0\n");
  expect(checkMount(host_), Health::warning, "not a file system of its own", "mount -t tmpfs");
}

TEST_F(MemoryChecks, LittleSpaceIsAWarningAndNoSpaceAProblem) {
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

TEST_F(MemoryChecks, SharedMemoryMustBeWritableByAllAndSticky) {
  chmod("dev/shm", 0777);
  expect(checkRights(host_), Health::warning, "mode 0777: any user may remove", "chmod 1777");
  chmod("dev/shm", 0755);
  expect(checkRights(host_), Health::problem, "mode 0755: not every user may create", "chmod 1777");
  remove("dev/shm");
  expect(checkRights(host_), Health::problem, "/dev/shm does not exist", "mkdir");
}

TEST_F(MemoryChecks, CountsSegmentsThatThisUserMayNotRead) {
  leave("mpf.lab.s.0.dac", 0644);
  leave("mpf.lab.h.1", 0600);
  leave("notes", 0600);
  if (::geteuid() == 4711) GTEST_SKIP() << "the files belong to this user";

  expect(checkSegments(host_), Health::warning, "this user may not read 1 of 2 files", "--group");

  write("proc/self/status", "Uid:\t0 0 0 0\nGid:\t0 0 0 0\nGroups:\t\n");
  expect(checkSegments(host_), Health::ok, "2 files");
}

TEST_F(MemoryChecks, AcceptsSegmentsThatTheGroupMayRead) {
  leave("mpf.lab.h.1", 0660);
  write("proc/self/status",
        "Uid:\t4711 4711 4711 4711\nGid:\t" + std::to_string(::getegid()) + " 1 1 1\n");

  expect(checkSegments(host_), Health::ok, "1 files");
}

TEST_F(MemoryChecks, CountsWindowsOfAnotherPidNamespace) {
  leaveWindow("here", ownNamespace());
  leaveWindow("there", ownNamespace() + 1);
  write("dev/shm/mpf.lab.c.1", "cut");
  expect(checkNamespaces(host_), Health::warning, "1 of 2 windows", "--pid=host");
  remove("dev/shm/mpf.lab.s.0.there");
  expect(checkNamespaces(host_), Health::ok, "1 windows");
}

class RemoveIpc : public MemoryChecks {
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

}  // namespace
}  // namespace mpf::tools
