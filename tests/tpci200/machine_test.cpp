// SPDX-License-Identifier: MIT
// Boots the machine of this folder, which runs board_test.cpp and two serial servers on octal UARTs
// behind the TPCI200; instruments are here, at the far ends of their lines. `make test-tpci200`
// sets MPF_TEST_TPCI200 to the build that the machine was made of.
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

// An instrument where QEMU finds it, should it come.
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
  ~Line() { ::shutdown(listener_.get(), SHUT_RDWR); }  // nobody came: the thread waits no longer
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string received() const { return instrument_.received(); }

 private:
  std::string path_;
  FileDescriptor listener_;
  Instrument instrument_;
  std::jthread thread_;  // last: ends before what it uses
};

// Until it ends. They are shown as they come: who waits for nothing sees where.
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
  if (build == nullptr)
    GTEST_SKIP() << "no emulated machine with a TPCI200: make test-tpci200 makes one";
  const Watchdog watchdog("the machine");
  const TemporaryFolder folder;
  const Line voltmeter(folder.file("voltmeter"));
  const Line counter(folder.file("counter"));

  const Program machine({MPF_TEST_BOOT, "boot", build, voltmeter.path(), counter.path()});
  const auto said = linesOf(machine);

  for (const auto* const part : {"no driver", "uio_pci_generic", "voltmeter", "counter", "msr"})
    EXPECT_THAT(said, Contains(std::string("status of ") + part + ": 0"));
  EXPECT_THAT(said, Contains(HasSubstr("the end, after")));
  EXPECT_THAT(said, Contains(HasSubstr("carrier ipac is TPCI200 at ")).Times(2));
  EXPECT_THAT(said, Contains(HasSubstr("value=\"MPF,INSTRUMENT,0,1.0\\r\\n\"")).Times(40));
  std::string asked;
  for (int i = 0; i < 20; ++i) asked += "*IDN?\n";
  EXPECT_EQ(voltmeter.received(), asked);
  EXPECT_EQ(counter.received(), asked);
}

}  // namespace
}  // namespace mpf::test
