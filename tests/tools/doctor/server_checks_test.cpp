// SPDX-License-Identifier: MIT
// The check whether servers can accept more clients, on a host of the test.
#include <optional>

#include <mpf/message_server.h>

#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/tools/doctor/doctor_fixture.h"

namespace mpf::tools {
namespace {

// Servers of this process, whose windows are copied to the host.
class ServerChecks : public test::DoctorHostTest {
 protected:
  // Copies the window of the server, which says that it lacks `shortage`.
  FileDescriptor copyServer(const MessageServer& server,
                            layout::Shortage shortage = layout::Shortage::none) const {
    const auto segment = SegmentName::serverWindow(backplane_.name(), 0, server.getName());
    const auto window =
        Segment::tryOpen(segment, layout::SegmentKind::serverWindow, Segment::Access::readWrite);
    window->at<layout::WindowControl>(layout::kWindowControlOffset)
        .shortage.store(shortage, std::memory_order_relaxed);
    return copyAlive(segment);
  }
  // Says that this process has `used` of `limit` files open.
  void openFiles(int used, const std::string& limit) const {
    const auto process = "proc/" + std::to_string(::getpid());
    remove(process);
    for (int i = 0; i < used; ++i) write(process + "/fd/" + std::to_string(i), "");
    write(process + "/limits", "Limit  Soft  Hard\nMax open files            " + limit +
                                   "                 524288               files     \n");
  }

  test::TestBackplane backplane_;
  MessageServer dac_{backplane_, "dac"};
};

TEST_F(ServerChecks, CountServersThatAreAlive) {
  expect(checkServers(host_), Health::ok, "no server is running");

  auto lock = copyServer(dac_);
  openFiles(4, "1024");
  expect(checkServers(host_), Health::ok, "1 server");

  lock.reset();
  expect(checkServers(host_), Health::ok, "no server is running");
}

TEST_F(ServerChecks, AServerThatRefusesClientsIsAProblem) {
  const auto server = "\"dac\" (pid " + std::to_string(::getpid()) + ") refuses clients: ";
  const auto check = [&](layout::Shortage shortage, const std::string& reason,
                         const std::string& remedy) {
    const auto lock = copyServer(dac_, shortage);
    expect(checkServers(host_), Health::problem, server + reason, remedy);
  };

  check(layout::Shortage::descriptors, "its process has no file descriptor left", "LimitNOFILE");
  check(layout::Shortage::openFiles, "the host has no open file left", "fs.file-max");
  check(layout::Shortage::memory, "no memory is left", "end programs");
  check(layout::Shortage::threads, "its process can start no thread", "ulimit -u");
}

// The server says so until it accepts the next client.
TEST_F(ServerChecks, AServerWhoseClientsHaveGoneRefusesNoMore) {
  const auto lock = copyServer(dac_, layout::Shortage::descriptors);

  openFiles(14, "16");
  expect(checkServers(host_), Health::problem, "no file descriptor left", "LimitNOFILE");
  openFiles(11, "16");
  expect(checkServers(host_), Health::ok, "1 server");
}

TEST_F(ServerChecks, AServerWithNearlyAllFilesOpenIsAProblem) {
  const auto lock = copyServer(dac_);

  openFiles(94, "100");
  expect(checkServers(host_), Health::ok, "1 server");
  openFiles(95, "100");
  expect(checkServers(host_), Health::problem, " has 95 of 100 files open", "ulimit -n");
  openFiles(95, "unlimited");
  expect(checkServers(host_), Health::ok, "1 server");
}

// Another user's process shows neither its files nor its limits.
TEST_F(ServerChecks, AServerWhoseFilesAreHiddenIsNoProblem) {
  const auto lock = copyServer(dac_);
  openFiles(0, "0");

  expect(checkServers(host_), Health::ok, "1 server");
}

TEST_F(ServerChecks, NameTheFirstOfSeveralServers) {
  const MessageServer adc(backplane_, "adc");
  const auto first = copyServer(adc, layout::Shortage::memory);
  const auto second = copyServer(dac_, layout::Shortage::memory);

  expect(checkServers(host_), Health::problem, "no memory is left; and 1 more", "end programs");
  EXPECT_THAT(checkServers(host_).seen, testing::StartsWith("\"adc\""));
}

TEST_F(ServerChecks, IgnoreFilesThatAreNotServers) {
  write("dev/shm/mpf.lab.s.0.junk", "junk");
  write("dev/shm/mpf.lab.h.1", "");
  write("dev/shm/notes", "");

  expect(checkServers(host_), Health::ok, "no server is running");
}

}  // namespace
}  // namespace mpf::tools
