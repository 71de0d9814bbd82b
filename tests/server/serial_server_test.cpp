// SPDX-License-Identifier: MIT
// A serial server on a real pseudo-terminal with an instrument at its far end, asked through shared memory.
#include <mpf/schema/serial_server.h>

#include <unistd.h>

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include <mpf/client/sync_client.h>
#include <mpf/drivers/serial/posix_terminal_port.h>
#include <mpf/server/programs/serial_server/serial_server.h>
#include <mpf/tests/support/instrument.h>
#include <mpf/tests/support/watchdog.h>

namespace mpf::test {
namespace {

using namespace serial;
using namespace std::chrono_literals;

class SerialServerTest : public testing::Test {
 protected:
  void start(const SerialServerOptions& options = {.bufferBytes = 100, .eom = "\r\n", .circularBuffer = true}) {
    serial_ = std::make_unique<SerialServer>(server_, port_, options, log_);
    thread_ = std::thread([this] { server_.run(); });
    ASSERT_TRUE(client_.connectWait(60s));
  }
  void TearDown() override {
    server_.interrupt();
    if (thread_.joinable()) thread_.join();
  }
  static std::string linkPath() {
    static int count = 0;
    return std::filesystem::temp_directory_path() / ("mpf-serial-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
  }

  struct Reply {
    std::int32_t status;
    std::string text;
  };
  // Asks with a timeout in milliseconds, unless `fields` say otherwise.
  Reply ask(std::string_view text, Char8Array fields) {
    auto message = Char8ArrayMessage::allocValue(text.size());
    *message = fields;
    message.setSize(text.size());
    std::copy(text.begin(), text.end(), message.value().begin());
    auto answer = client_.call(std::move(message), 60s);
    EXPECT_TRUE(answer) << answer.why();
    auto reply = answer.as<Char8Array>();
    if (!reply) return {-1, "not a Char8Array"};
    return {(*reply)->status, std::string(reply->value().begin(), reply->value().end())};
  }
  static Char8Array fieldsOf(std::int32_t cmd, std::int32_t timeoutMs = 60'000) {
    return {.timeout = timeoutMs, .cmd = cmd | cmdTimeoutMilliseconds};
  }

  Watchdog watchdog_{"serial server test"};
  ServerLog log_{"test", "off"};
  std::string path_ = linkPath();
  Instrument instrument_{path_};
  PosixTerminalPort port_{{.device = path_, .settings = {9600, 1, 8, 'N', 'N'}}};
  Backplane backplane_ = Backplane::isolated();
  MessageServer server_{backplane_, "serial[0]"};
  std::unique_ptr<SerialServer> serial_;
  std::thread thread_;
  SyncClient client_{backplane_, "serial[0]"};
};

TEST_F(SerialServerTest, AQueryBringsTheAnswerWithItsTerminator) {
  start();

  const auto reply = ask("ECHO hello\n", fieldsOf(cmdWriteRead | cmdFlush));

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "hello\r\n");
}

TEST_F(SerialServerTest, ATimeoutInWholeSecondsIsAcceptedToo) {
  start();

  const auto reply = ask("ECHO hello\n", {.timeout = 60, .cmd = cmdWriteRead});

  EXPECT_EQ(reply.status, serialServerStatusOK);
}

TEST_F(SerialServerTest, SilenceIsATimeout) {
  start();
  instrument_.behave({.isSilent = true});

  const auto reply = ask("ECHO hello\n", fieldsOf(cmdWriteRead, 20));

  EXPECT_EQ(reply.status, serialServerStatusTimeout);
  EXPECT_EQ(reply.text, "");
}

TEST_F(SerialServerTest, ATimeoutStillCarriesWhatWasRead) {
  start();
  instrument_.behave({.answerEnd = ""});

  const auto reply = ask("ECHO half\n", fieldsOf(cmdWriteRead, 200));

  EXPECT_EQ(reply.status, serialServerStatusTimeout);
  EXPECT_EQ(reply.text, "half");
}

TEST_F(SerialServerTest, SplitAnswersArePutTogether) {
  start();
  instrument_.behave({.gap = 1ms});

  EXPECT_EQ(ask("ECHO one by one\n", fieldsOf(cmdWriteRead)).text, "one by one\r\n");
}

TEST_F(SerialServerTest, ExtraEndsAReadAfterSoManyBytes) {
  start({.bufferBytes = 100, .eom = "", .circularBuffer = false});
  auto fields = fieldsOf(cmdWriteRead);
  fields.extra = 4;

  const auto reply = ask("ECHO binary\n", fields);

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "bina");
}

TEST_F(SerialServerTest, AnAnswerLongerThanTheBufferOverflows) {
  start({.bufferBytes = 5, .eom = "\r\n", .circularBuffer = false});

  const auto reply = ask("ECHO much too long\n", fieldsOf(cmdWriteRead));

  EXPECT_EQ(reply.status, serialServerStatusOverflow);
  EXPECT_EQ(reply.text, "much ");
}

TEST_F(SerialServerTest, ANewTerminatorHoldsForLaterRequests) {
  start();
  auto fields = fieldsOf(cmdWriteRead | cmdSetEom);
  fields.eomLen = 1;
  fields.eomString = {'l'};

  EXPECT_EQ(ask("ECHO hello\n", fields).text, "hel");
  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead | cmdFlush)).text, "hel");
}

TEST_F(SerialServerTest, ATerminatorLengthOutOfRangeIsTolerated) {
  start();
  auto fields = fieldsOf(cmdWriteRead | cmdSetEom);
  fields.eomLen = 3;
  fields.eomString = {'\r', '\n'};

  EXPECT_EQ(ask("ECHO hello\n", fields).text, "hello\r\n");
}

TEST_F(SerialServerTest, CircularModeKeepsLinesForLaterReads) {
  start();
  ASSERT_EQ(ask("", fieldsOf(cmdRead | cmdStartCircularBuffer, 0)).status, serialServerStatusTimeout);

  ASSERT_EQ(ask("ECHO first\nECHO second\n", fieldsOf(cmdWrite)).status, serialServerStatusOK);

  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "first\r\n");
  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "second\r\n");
}

TEST_F(SerialServerTest, RetriesUntilTheInstrumentAnswers) {
  start();
  instrument_.behave({.delay = 30ms});
  auto fields = fieldsOf(cmdWriteRead, 20);
  fields.numberRetrys = 1000;

  const auto reply = ask("ECHO late\n", fields);

  EXPECT_EQ(reply.status, serialServerStatusOK);
  EXPECT_EQ(reply.text, "late\r\n");
}

TEST_F(SerialServerTest, AnUnpluggedLineIsAnErrorAndComesBack) {
  start();
  instrument_.unplug();
  ASSERT_TRUE(port_.waitForState(SerialPortState::unplugged, Deadline::never()));
  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead)).status, serialServerStatusError);

  instrument_.plugIn();
  ASSERT_TRUE(port_.waitForState(SerialPortState::plugged, Deadline::never()));

  EXPECT_EQ(ask("ECHO hello\n", fieldsOf(cmdWriteRead)).text, "hello\r\n");
}

TEST_F(SerialServerTest, ACommandThatIsNoneIsAnError) {
  start();

  EXPECT_EQ(ask("", fieldsOf(cmdFlush)).status, serialServerStatusError);
}

TEST_F(SerialServerTest, SettingsAreAnsweredByAnInt32) {
  start();

  auto accepted = client_.call(SerialConfigMessage({.baud = 19200}), 60s);
  auto refused = client_.call(SerialConfigMessage({.stopBits = 7}), 60s);

  ASSERT_NE(accepted.message().tryAs<Int32>(), nullptr);
  EXPECT_EQ(accepted.message().tryAs<Int32>()->status, 0);
  EXPECT_EQ(refused.message().tryAs<Int32>()->status, serialServerStatusError);
}

TEST_F(SerialServerTest, OtherTypesAreRefused) {
  start();

  EXPECT_EQ(client_.call(Float64Message(), 60s).fate(), Fate::refused);
}

}  // namespace
}  // namespace mpf::test
