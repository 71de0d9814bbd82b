// SPDX-License-Identifier: MIT
// Clients of EPICS by other authors, as processes: they read, write and monitor records of mpf-ioc
// that talk to a server in a third process.
//
//   client ── Channel Access or pvAccess ──► mpf-ioc ── backplane ──► mpf-digital-io-server
//
// The inputs of the server's module are its outputs. The IOC listens on an address of its own.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <memory>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

constexpr const char* kDatabase = R"(
record(longout, "out") { field(DTYP, "MPF")
  field(OUT, "@dioOut cmd=6 address=0xff readback=7 rewrite=yes") }
record(longin, "in") { field(DTYP, "MPF") field(INP, "@dioIn cmd=3 address=0xff mask=0xff")
  field(SCAN, "I/O Intr") }
)";

// What clients print: value and severity.
constexpr const char* kInitial = "255 0";
constexpr const char* kFiveValid = "5 0";
constexpr const char* kFiveInvalid = "5 3";

// An address of 127.0.0.0/8 that no other running process uses.
std::string ownAddress() {
  const auto number = static_cast<unsigned>(::getpid());
  return fmt::format("127.{}.{}.{}", 1 + (number >> 16U) % 250, (number >> 8U) & 0xffU,
                     number & 0xffU);
}

// A port for pvAccess that was free. At the usual port, a server of another process that listens on
// all addresses would get the searches.
std::string freePort(const std::string& address) {
  const FileDescriptor socket(
      checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
  sockaddr_in at{};
  at.sin_family = AF_INET;
  checkCall(::inet_pton(AF_INET, address.c_str(), &at.sin_addr), "inet_pton");
  socklen_t length = sizeof at;
  checkCall(::bind(socket.get(), reinterpret_cast<sockaddr*>(&at), length), "bind");
  checkCall(::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&at), &length), "getsockname");
  return std::to_string(ntohs(at.sin_port));
}

struct Client {
  std::string name;
  std::vector<std::string> command;
  std::string module;  // of Python; empty: none
  std::string definitions;  // dbd file that the IOC must have; empty: none
};

Client python(const std::string& module, const std::string& definitions) {
  return {.name = module,
          .command = {MPF_TEST_PYTHON, fmt::format("{}/{}_client.py", MPF_TEST_CLIENTS, module)},
          .module = module,
          .definitions = definitions};
}

class EpicsClients : public testing::TestWithParam<Client> {
 protected:
  EpicsClients();
  void SetUp() override {
    const auto& [name, command, module, definitions] = GetParam();
    if (!definitions.empty() && !std::filesystem::exists(definitions))
      GTEST_SKIP() << "mpf-ioc was built without " << definitions;
    if (!module.empty() &&
        runCommand(fmt::format("{} -c 'import {}' 2>&1", MPF_TEST_PYTHON, module)).status != 0)
      GTEST_SKIP() << module << " is not installed: run scripts/setup";
    server_ = startServer();
    ioc_ = std::make_unique<Program>(
        std::vector<std::string>{MPF_TEST_IOC, "-S", "-d", folder_.write("a.db", kDatabase)});
  }

  [[nodiscard]] static std::unique_ptr<Program> startServer() {
    return std::make_unique<Program>(std::vector<std::string>{
        MPF_TEST_DIGITAL_IO_SERVER, "dio", "ipac", "IP_a", "--carrier", "ipac=model"});
  }
  [[nodiscard]] static std::unique_ptr<Program> start(const std::vector<std::string>& words) {
    auto command = GetParam().command;
    command.insert(command.end(), words.begin(), words.end());
    return std::make_unique<Program>(command);
  }
  // Runs a client to its end, and returns what it prints.
  [[nodiscard]] static std::string run(const std::vector<std::string>& words) {
    const auto client = start(words);
    auto printed = client->errors();
    EXPECT_EQ(client->wait(), 0);
    return printed;
  }
  // Writes 5, once the IOC has connected to the server and read the outputs.
  static void putFive() {
    std::string printed;
    do printed = run({"get", "out"});
    while (printed.find(kInitial) == std::string::npos);
    static_cast<void>(run({"put", "out", "5"}));
  }
  // Waits for the next update of a monitor with this text.
  static void waitForUpdate(const Program& monitor, const std::string& text) {
    for (auto line = monitor.line(); line != text; line = monitor.line())
      ASSERT_NE(line, "") << "the monitor has ended before " << text;
  }

  const TemporaryFolder folder_;
  const TestBackplane backplane_;
  std::unique_ptr<Program> server_;
  std::unique_ptr<Program> ioc_;
  const Watchdog watchdog_{"EPICS client"};
};

EpicsClients::EpicsClients() {
  const auto address = ownAddress();
  for (const auto* variable :
       {"EPICS_CAS_INTF_ADDR_LIST", "EPICS_CAS_BEACON_ADDR_LIST", "EPICS_PVAS_INTF_ADDR_LIST",
        "EPICS_PVAS_BEACON_ADDR_LIST", "EPICS_CA_ADDR_LIST"})
    ::setenv(variable, address.c_str(), 1);
  const auto port = freePort(address);
  ::setenv("EPICS_PVAS_SERVER_PORT", port.c_str(), 1);
  ::setenv("EPICS_PVA_NAME_SERVERS", fmt::format("{}:{}", address, port).c_str(), 1);
  for (const auto* variable :
       {"EPICS_CAS_AUTO_BEACON_ADDR_LIST", "EPICS_PVAS_AUTO_BEACON_ADDR_LIST",
        "EPICS_CA_AUTO_ADDR_LIST", "EPICS_PVA_AUTO_ADDR_LIST"})
    ::setenv(variable, "NO", 1);
  ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
  ::setenv("PYTHONPATH", MPF_TEST_PYTHONPATH, 1);
}

TEST_P(EpicsClients, GetsAndPuts) {
  putFive();

  EXPECT_THAT(run({"get", "out"}), testing::HasSubstr(kFiveValid));
}

// The monitor of another record, which the server notifies of the new inputs.
TEST_P(EpicsClients, MonitorsAServerThatIsKilledAndRestarted) {
  const auto monitor = start({"monitor", "in"});
  putFive();
  waitForUpdate(*monitor, kFiveValid);

  server_->end(SIGKILL);

  waitForUpdate(*monitor, kFiveInvalid);
  server_ = startServer();
  waitForUpdate(*monitor, kFiveValid);
}

INSTANTIATE_TEST_SUITE_P(Clients, EpicsClients,
                         testing::Values(Client{"libca", {MPF_TEST_LIBCA_CLIENT}, "", ""},
                                         python("caproto", ""),
                                         python("p4p", MPF_TEST_DBD "/pvxsIoc.dbd")),
                         [](const testing::TestParamInfo<Client>& client) {
                           return client.param.name;
                         });

}  // namespace
}  // namespace mpf::test
