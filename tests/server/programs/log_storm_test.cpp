// SPDX-License-Identifier: MIT
// Ten thousand invalid requests to each server program: its log stays short and counts all of them.
#include <atomic>
#include <future>
#include <gtest/gtest.h>
#include <memory>

#include <mpf/message_client.h>

#include "client/relay_client.h"
#include "tests/support/log_lines.h"
#include "tests/support/program.h"
#include "tests/support/pty.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kRequests = 10'000;
constexpr std::uint64_t kMostLines = 100;

class LogStormTest : public testing::Test {
 protected:
  void TearDown() override {
    if (!said_.valid()) return;  // the test has read it
    program_->signal(SIGKILL);
    said_.wait();
  }
  void start(std::vector<std::string> command) {
    command.insert(command.end(), {"--backplane", backplane_.name(), "--log-level", "debug"});
    program_ = std::make_unique<Program>(std::move(command));
    said_ = std::async(std::launch::async, [this] { return program_->errors(); });
  }
  // Sends `request` to `server` kRequests times, many at once, and waits for all replies and fates.
  void storm(const std::string& server, const Message& request) {
    std::atomic<std::uint64_t> ends{0};
    MessageClient client(backplane_, [&](const Message& message) {
      if (!RelayClient::endsRequest(message)) return;
      ++ends;
      ends.notify_one();
    });
    client.bind(server);
    ASSERT_TRUE(client.connectWait(60s)) << client.notConnectedBecause();
    for (std::uint64_t sent = 0; sent < kRequests;) {
      const auto before = ends.load();
      if (client.send(copyOf(request)) == SendResult::sent) ++sent;
      else ends.wait(before);
    }
    for (auto now = ends.load(); now < kRequests; now = ends.load()) ends.wait(now);
  }
  static Message copyOf(const Message& request) {
    if (const auto* float64 = request.tryAs<Float64>()) return Float64Message(*float64);
    if (const auto* config = request.tryAs<SerialConfig>()) return SerialConfigMessage(*config);
    if (request.tryAs<Char8Array>() != nullptr) return Char8ArrayMessage::allocValue(0);
    return Int32Message(*request.tryAs<Int32>());
  }
  // Stops the program. `text` is in the lines about each request.
  void expectShortLog(const std::string& text, std::uint64_t lines = kRequests) {
    program_->signal(SIGTERM);
    const auto said = said_.get();
    const auto status = program_->wait();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    const auto count = countLines(said, text);
    EXPECT_EQ(count.meant, lines) << said;
    EXPECT_LT(count.all, kMostLines) << said.substr(0, 10'000);
  }

  const Watchdog watchdog_{"log storm test"};
  const TestBackplane backplane_;
  std::unique_ptr<Program> program_;
  std::future<std::string> said_;
};

TEST_F(LogStormTest, OfTheIp330ServersConfiguration) {
  start({MPF_TEST_IP330_SERVER, "adc", "ipac", "IP_a", "D", "-5to5", "--carrier", "ipac=model",
         "--config", "adcConfig"});
  storm("adcConfig", Int32Message({.cmd = 4711}));
  expectShortLog("config: cmd 4711, value 0: status -1");
}

TEST_F(LogStormTest, OfTheIp330ServersScan) {
  start({MPF_TEST_IP330_SERVER, "adc", "ipac", "IP_a", "D", "-5to5", "--carrier", "ipac=model",
         "--scan", "adc"});
  storm("adc", Int32Message({.address = 4711}));
  expectShortLog("scan: channel 4711");
}

TEST_F(LogStormTest, OfTheDac128vServer) {
  start({MPF_TEST_DAC128V_SERVER, "dac", "ipac", "IP_a", "20", "--carrier", "ipac=model"});
  storm("dac", Int32Message({.address = 4711}));
  expectShortLog("channel 4711");
}

TEST_F(LogStormTest, OfTheDigitalIoServersOutputs) {
  start({MPF_TEST_DIGITAL_IO_SERVER, "dio", "ipac", "IP_b", "--carrier", "ipac=model"});
  storm("dioOut", Int32Message({.cmd = 4711}));
  expectShortLog("outputs: unknown cmd 4711");
}

TEST_F(LogStormTest, OfTheDigitalIoServersInputs) {
  start({MPF_TEST_DIGITAL_IO_SERVER, "dio", "ipac", "IP_b", "--carrier", "ipac=model"});
  storm("dioIn", Int32Message({.cmd = 4711}));
  expectShortLog("inputs: unknown cmd 4711");
}

TEST_F(LogStormTest, OfTheIp440Server) {
  start({MPF_TEST_IP440_SERVER, "door", "ipac", "IP_c", "--carrier", "ipac=model"});
  storm("door", Int32Message({.cmd = 4711}));
  expectShortLog("unknown cmd 4711");
}

TEST_F(LogStormTest, OfTheSerialServer) {
  const TemporaryFolder folder;
  const Pty pty(folder.file("line"));
  start({MPF_TEST_SERIAL_SERVER, "dmm", folder.file("line")});
  storm("dmm", Int32Message({.cmd = 4711}));
  expectShortLog("a request of type int32: status -1");
}

TEST_F(LogStormTest, OfTheSerialServersSettings) {
  const TemporaryFolder folder;
  const Pty pty(folder.file("line"));
  start({MPF_TEST_SERIAL_SERVER, "dmm", folder.file("line")});
  storm("dmm", SerialConfigMessage({.baud = -4711}));
  expectShortLog("settings refused");
}

TEST_F(LogStormTest, OfTheGpibServer) {
  start({MPF_TEST_GPIB_SERVER, "gpib", "module", "--ti9914", "module,ipac,IP_a,105", "--carrier",
         "ipac=model"});
  storm("gpib", Char8ArrayMessage::allocValue(0));
  expectShortLog("an invalid request: cmd 0x0");
}

// They log nothing about requests of other types.
TEST_F(LogStormTest, OfTheEchoServers) {
  start({MPF_TEST_INT32_SERVER});
  storm("Int32", Float64Message({.value = 1}));
  expectShortLog("Float64", 0);
  start({MPF_TEST_CHAR8_ARRAY_SERVER});
  storm("Char8Array", Float64Message({.value = 1}));
  expectShortLog("Float64", 0);
}

// A server of another type refuses each message of the client immediately.
TEST_F(LogStormTest, OfAClientProgramWhoseMessagesAreRefused) {
  constexpr std::uint64_t kMessages = 2000;  // one by one
  start({MPF_TEST_CHAR8_ARRAY_SERVER});
  Program client({MPF_TEST_INT32_CLIENT, "Char8Array", "--backplane", backplane_.name(), "--count",
                  std::to_string(kMessages), "--timeout", "60"});

  const auto said = client.errors();

  EXPECT_EQ(WEXITSTATUS(client.wait()), 1);
  const auto count = countLines(said, "message ");
  EXPECT_EQ(count.meant, kMessages) << said;
  EXPECT_LT(count.all, kMostLines) << said.substr(0, 10'000);
}

}  // namespace
}  // namespace mpf::test
