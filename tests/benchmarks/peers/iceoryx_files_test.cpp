// SPDX-License-Identifier: MIT
// The files that killed processes of a measurement leave of iceoryx.
#include "benchmarks/peers/iceoryx_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/temporary_folder.h"

namespace mpf::bench {
namespace {

void leaveSocket(const std::string& path) {
  const FileDescriptor socket(checkCall(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket"));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(std::data(address.sun_path), sizeof address.sun_path - 1);
  checkCall(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
            "bind", path);
}

std::vector<std::string> namesIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename());
  return names;
}

TEST(IceoryxFiles, RemovesOnlyThoseOfDeadProcesses) {
  const test::TemporaryFolder folder;
  folder.write("mpf-bench-1-server.lock", "");
  leaveSocket(folder.file("mpf-bench-1-server"));
  folder.write("another.lock", "");
  // a name that mkstemp() has not filled in
  const auto settings = "mpf-bench-roudi-" + std::string(6, 'X');
  folder.write(settings, "[general]");
  const FileDescriptor held(
      ::open(folder.write("mpf-bench-2-client.lock", "").c_str(), O_RDWR | O_CLOEXEC));
  leaveSocket(folder.file("mpf-bench-2-client"));
  checkCall(::flock(held.get(), LOCK_EX), "flock");

  removeIceoryxFiles(folder.path());

  EXPECT_THAT(namesIn(folder.path()),
              testing::UnorderedElementsAre("another.lock", settings, "mpf-bench-2-client.lock",
                                            "mpf-bench-2-client"));
}

TEST(IceoryxFiles, RemovesThoseOfADeadDaemon) {
  const test::TemporaryFolder folder;
  const test::TemporaryFolder sharedMemory;
  for (const char* name : {"iox-unique-roudi.lock", "roudi.lock", "another.lock"})
    folder.write(name, "");
  leaveSocket(folder.file("roudi"));
  const std::string segment = ::getgrgid(::getegid())->gr_name;
  for (const auto& name : {std::string("iceoryx_mgmt"), segment, std::string("another")})
    sharedMemory.write(name, "");
  {
    const FileDescriptor held(
        ::open(folder.file("iox-unique-roudi.lock").c_str(), O_RDWR | O_CLOEXEC));
    checkCall(::flock(held.get(), LOCK_EX), "flock");
    removeRouDiFiles(folder.path(), sharedMemory.path());
    EXPECT_EQ(namesIn(folder.path()).size(), 4U) << "the daemon is running";
  }

  removeRouDiFiles(folder.path(), sharedMemory.path());

  EXPECT_THAT(namesIn(folder.path()), testing::ElementsAre("another.lock"));
  EXPECT_THAT(namesIn(sharedMemory.path()), testing::ElementsAre("another"));
}

}  // namespace
}  // namespace mpf::bench
