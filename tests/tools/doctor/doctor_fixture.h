// SPDX-License-Identifier: MIT
// DoctorHostTest: a host made of files in a temporary folder, for the checks of `mpf doctor`.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "shm/segment.h"
#include "tests/support/temporary_folder.h"
#include "tools/doctor/checks.h"

namespace mpf::test {

inline constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;

// A host without problems, until a test changes it.
class DoctorHostTest : public testing::Test {
 protected:
  DoctorHostTest() {
    host_.root = folder_.path();
    host_.sharedMemory = [] {
      return tools::Host::Space{8 * kGiB, 7 * kGiB, 1'000'000, 2'000'000};
    };
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
  // Copies a segment of /dev/shm to this host. The returned file holds the lock of its owner.
  [[nodiscard]] FileDescriptor copyAlive(const std::string& segment) const {
    const auto copy = host_.root / "dev/shm" / segment;
    std::filesystem::copy_file(segments::path(segment), copy,
                               std::filesystem::copy_options::overwrite_existing);
    FileDescriptor file(checkCall(::open(copy.c_str(), O_RDWR | O_CLOEXEC), "open", segment));
    struct flock lock{};
    lock.l_type = F_WRLCK;
    checkCall(::fcntl(file.get(), F_OFD_SETLK, &lock), "lock", segment);
    return file;
  }

  static void expect(const tools::Finding& finding, tools::Health health, const std::string& seen,
                     const std::string& remedy = "") {
    EXPECT_STREQ(toString(finding.health), toString(health))
        << finding.check << ": " << finding.seen;
    EXPECT_THAT(finding.seen, testing::HasSubstr(seen)) << finding.check;
    if (remedy.empty()) EXPECT_EQ(finding.remedy, "") << finding.check;
    else EXPECT_THAT(finding.remedy, testing::HasSubstr(remedy)) << finding.check;
  }

  TemporaryFolder folder_;
  tools::Host host_;
};

}  // namespace mpf::test
