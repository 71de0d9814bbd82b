// SPDX-License-Identifier: MIT
// Boots the emulated machine of this folder, which runs board_test.cpp and two serial servers on
// the octal UARTs of a TPCI200. The instruments at the far ends of the lines run in this process.
// `make test-tpci200` sets MPF_TEST_TPCI200 to the build whose programs the machine runs.
#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <gmock/gmock.h>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/instrument.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::Contains;
using testing::HasSubstr;

// An instrument on a Unix socket, to which QEMU connects a serial line.
class Line {
 public:
  explicit Line(std::string path)
      : path_(std::move(path)),
        listener_(checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket")) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(static_cast<char*>(address.sun_path), sizeof(address.sun_path) - 1);
    checkCall(::bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)),
              "bind", path_);
    checkCall(::listen(listener_.get(), 1), "listen");
    thread_ = std::jthread([this] {
      FileDescriptor line(
          ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (line) instrument_.connect(std::move(line));
    });
  }
  // The shutdown ends the accept4() of the thread if QEMU has not connected.
  ~Line() { ::shutdown(listener_.get(), SHUT_RDWR); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string received() const { return instrument_.received(); }

 private:
  std::string path_;
  FileDescriptor listener_;
  Instrument instrument_;
  std::jthread thread_;  // last: ends before the members that it uses
};

// Returns the lines of the program's output until it ends. Prints each line at once, so that the
// output shows the progress when the machine hangs.
std::vector<std::string> linesOf(const Program& program) {
  std::vector<std::string> lines;
  for (auto line = program.line(); !line.empty(); line = program.line()) {
    std::puts(line.c_str());
    if (line.ends_with('\r')) line.pop_back();
    lines.push_back(line);
  }
  return lines;
}

TEST(Tpci200Machine, ServesInstrumentsOnOctalUarts) {
  const char* const build = std::getenv("MPF_TEST_TPCI200");
  if (build == nullptr) GTEST_SKIP() << "needs an emulated machine: run make test-tpci200";
  const Watchdog watchdog("the machine");
  const TemporaryFolder folder;
  const Line voltmeter(folder.file("voltmeter"));
  const Line counter(folder.file("counter"));

  const Program machine({MPF_TEST_BOOT, "boot", build, voltmeter.path(), counter.path()});
  const auto output = linesOf(machine);

  for (const auto* const part : {"no driver", "uio_pci_generic", "voltmeter", "counter", "msr"})
    EXPECT_THAT(output, Contains(std::string("status of ") + part + ": 0"));
  EXPECT_THAT(output, Contains(HasSubstr("the end, after")));
  EXPECT_THAT(output, Contains(HasSubstr("carrier ipac is TPCI200 at ")).Times(2));
  EXPECT_THAT(output, Contains(HasSubstr("value=\"MPF,INSTRUMENT,0,1.0\\r\\n\"")).Times(40));
  std::string asked;
  for (int i = 0; i < 20; ++i) asked += "*IDN?\n";
  EXPECT_EQ(voltmeter.received(), asked);
  EXPECT_EQ(counter.received(), asked);
}

}  // namespace
}  // namespace mpf::test
