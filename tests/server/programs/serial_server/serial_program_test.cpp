// SPDX-License-Identifier: MIT
// mpf-serial-server as a process: how it stops, what it logs, which clients it admits.
#include <sys/stat.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <mutex>
#include <sstream>

#include <mpf/serial_commands.h>
#include <mpf/serial_sniff.h>
#include <mpf/sync_client.h>

#include "tests/support/alarms.h"
#include "tests/support/instrument.h"
#include "tests/support/log_lines.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace serial;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;

bool hasExitedWith(int status, int code) {
  return WIFEXITED(status) && WEXITSTATUS(status) == code;
}

// A client whose requests end in the background.
class Asker {
 public:
  explicit Asker(const Backplane& backplane)
      : client_(backplane, [this](Message&& message) { keep(std::move(message)); }) {
    client_.bind("dmm");
    EXPECT_TRUE(client_.connectWait(60s)) << client_.notConnectedBecause();
  }
  void send(std::string_view text, Char8Array fields) {
    auto message = client_.alloc<Char8Array>(text.size());
    fields.length = message->length;
    *message = fields;
    std::copy(text.begin(), text.end(), message.value().begin());
    EXPECT_EQ(client_.send(std::move(message)), SendResult::sent);
  }
  // The next reply or fate.
  Message next() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [&] { return !messages_.empty(); });
    auto message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }
  // Sends a request and returns the status of the reply.
  std::int32_t ask(std::string_view text) {
    send(text, {.timeout = 60, .cmd = cmdWriteRead});
    const auto reply = next();
    const auto* fields = reply.tryAs<Char8Array>();
    return fields != nullptr ? fields->status : -1;
  }

 private:
  void keep(Message&& message) {
    if (message.getType() == MessageType::connect) return;
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
    came_.notify_one();
  }
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Message> messages_;
  MessageClient client_;  // last: its callback uses the others
};

class SerialProgramTest : public testing::Test {
 protected:
  std::unique_ptr<Program> start(const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command{
        MPF_TEST_SERIAL_SERVER, "dmm", path_, "1000", "20", "\\r\\n", "--backplane",
        backplane_.name()};
    command.insert(command.end(), options.begin(), options.end());
    return std::make_unique<Program>(command);
  }
  static std::string linkPath() {
    return std::filesystem::temp_directory_path() /
           ("mpf-serial-program-" + std::to_string(::getpid()));
  }

  Watchdog watchdog_{"serial program test"};
  std::string path_ = linkPath();
  Instrument instrument_{path_};
  TestBackplane backplane_;
};

class SerialProgramSignalTest : public SerialProgramTest,
                                public testing::WithParamInterface<int> {};

TEST_P(SerialProgramSignalTest, StopsItDuringALongReadAndLeavesNoFiles) {
  const auto server = start();
  {
    Asker asker(backplane_);
    instrument_.behave({.answerEnd = ""});
    asker.send("ECHO half\n", {.timeout = 100'000, .cmd = cmdWriteRead, .numberRetrys = INT32_MAX});
    ASSERT_TRUE(instrument_.waitForReceived("ECHO half\n"));
    asker.send("ECHO never sent\n", {.timeout = 100'000, .cmd = cmdWriteRead});

    const auto status = server->end(GetParam());

    EXPECT_TRUE(hasExitedWith(status, 0)) << status;
    const auto onTheLine = asker.next();
    const auto notTaken = asker.next();
    ASSERT_NE(onTheLine.tryAs<Char8Array>(), nullptr);
    EXPECT_EQ(onTheLine.tryAs<Char8Array>()->status, serialServerStatusError);
    ASSERT_NE(notTaken.tryAs<RequestFate>(), nullptr);
    EXPECT_EQ(notTaken.tryAs<RequestFate>()->fate, Fate::neverTaken);
    EXPECT_EQ(instrument_.received(), "ECHO half\n");
  }
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_P(SerialProgramSignalTest, StopsItDuringAWriteThatTheLineBlocks) {
  const auto server = start();
  {
    Asker asker(backplane_);
    SyncClient listener(backplane_, "dmm.sniff");
    ASSERT_TRUE(listener.call(Int32Message({.cmd = cmdSniffStart}), 60s));
    instrument_.setReading(false);
    asker.send(std::string(1'000'000, 'x'), {.timeout = 100'000, .cmd = cmdWrite});
    ASSERT_TRUE(listener.receive(60s));

    const auto status = server->end(GetParam());

    EXPECT_TRUE(hasExitedWith(status, 0)) << status;
    const auto reply = asker.next();
    ASSERT_NE(reply.tryAs<Char8Array>(), nullptr);
    EXPECT_EQ(reply.tryAs<Char8Array>()->status, serialServerStatusError);
  }
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_P(SerialProgramSignalTest, StopsItWhileItWaitsForItsLine) {
  instrument_.unplug();
  const auto server = start({"--wait"});
  const auto connected = std::make_unique<Asker>(backplane_);

  const auto status = server->end(GetParam());
  EXPECT_TRUE(hasExitedWith(status, 0)) << status << ": " << server->errors();
}

INSTANTIATE_TEST_SUITE_P(Signals, SerialProgramSignalTest, testing::Values(SIGTERM, SIGINT));

TEST_F(SerialProgramTest, LogsItsEventsOnStderr) {
  const auto server = start({"--baud", "19200"});
  Asker asker(backplane_);
  ASSERT_EQ(asker.ask("ECHO a\n"), serialServerStatusOK);
  ASSERT_EQ(asker.ask("ECHO b\n"), serialServerStatusOK);
  instrument_.unplug();
  ASSERT_EQ(asker.ask("ECHO c\n"), serialServerStatusError);
  instrument_.plugIn();
  while (asker.ask("ECHO d\n") != serialServerStatusOK) {
  }

  ASSERT_TRUE(hasExitedWith(server->end(SIGTERM), 0));

  std::vector<std::string> lines;
  std::istringstream text(server->errors());
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  // The line and the server have separate threads: only the order of the lines of one thread is
  // certain.
  const auto ofLine = [](const std::string& line) {
    return line.find("the line is ") != std::string::npos;
  };
  const auto fromServer = std::stable_partition(lines.begin(), lines.end(), ofLine);
  EXPECT_THAT(std::vector(lines.begin(), fromServer),
              ElementsAre(HasSubstr("warning mpf-serial-server: the line is lost: "),
                          HasSubstr("the line is connected")));
  lines.erase(lines.begin(), fromServer);
  ASSERT_THAT(
      lines,
      ElementsAre(AllOf(HasSubstr("serving " + path_ +
                                  " (19200 baud, 8N1, no flow control) as \"dmm\" at location 0"),
                        HasSubstr("\"dmm.sniff\"")),
                  HasSubstr("info mpf-serial-server: first request"), HasSubstr("requests fail: "),
                  HasSubstr("requests succeed again"), HasSubstr("stopped")));
  EXPECT_THAT(lines[0],
              MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}[.][0-9]{3} info "
                           "mpf-serial-server: .*"));
}

// The log counts as many events as `mpf msr`, and does not contain the input.
TEST_F(SerialProgramTest, LogsSurplusInputWithEachAlarm) {
  const auto server = start({"--quiet-time", "1ms", "--resync-limit", "1min"});
  Asker asker(backplane_);
  for (int i = 0; i < 3; ++i) {
    // The instrument does not know this question: it says the answer after the timeout.
    asker.send("LATE?\n", {.timeout = 100, .cmd = cmdWriteRead | cmdTimeoutMilliseconds});
    const auto late = asker.next();
    ASSERT_NE(late.tryAs<Char8Array>(), nullptr);
    ASSERT_EQ(late.tryAs<Char8Array>()->status, serialServerStatusTimeout);
    instrument_.say("late\r\n");
    ASSERT_EQ(asker.ask("ECHO next\n"), serialServerStatusOK);
  }
  const auto alarms = alarmsOf(backplane_, "dmm");

  ASSERT_TRUE(hasExitedWith(server->end(SIGTERM), 0));

  const auto log = server->errors();
  EXPECT_EQ(alarms, 3U) << "one in each round";
  EXPECT_EQ(countLines(log, "surplus input: ").meant, alarms) << log;
  EXPECT_EQ(log.find("late"), std::string::npos) << "the log shows no input";
}

TEST_F(SerialProgramTest, RefusesInvalidLimits) {
  for (const auto& [option, value] :
       std::vector<std::array<std::string, 2>>{{"--settle-time", "-1"},
                                               {"--quiet-time", "3601"},
                                               {"--resync-limit", "soon"},
                                               {"--max-timeout", "0"},
                                               {"--max-retries", "-1"}}) {
    const auto server = start({option, value});

    EXPECT_TRUE(hasExitedWith(server->wait(), 2)) << option;
    EXPECT_THAT(server->errors(), HasSubstr(option));
  }
}

TEST_F(SerialProgramTest, LogsNothingAtLevelOff) {
  const auto server = start({"--log-level", "off"});
  Asker asker(backplane_);
  ASSERT_EQ(asker.ask("ECHO a\n"), serialServerStatusOK);

  ASSERT_TRUE(hasExitedWith(server->end(SIGTERM), 0));

  EXPECT_EQ(server->errors(), "");
}

TEST_F(SerialProgramTest, AdmitsTheClientsOfItsMode) {
  const auto* group = ::getgrgid(::getegid());
  ASSERT_NE(group, nullptr);
  const auto server = start({"--mode", "0660", "--group", group->gr_name});
  const Asker asker(backplane_);

  // The files of the server, for requests and for listeners, and the client's link to it.
  for (const auto* const name : {".s.0.dmm", ".s.0.dmm%2Esniff"}) {
    struct stat file{};
    ASSERT_EQ(::stat(("/dev/shm/mpf." + backplane_.name() + name).c_str(), &file), 0) << name;
    EXPECT_EQ(file.st_mode & 0777U, 0640U) << name;  // only the server may write to its window
    EXPECT_EQ(file.st_gid, ::getegid()) << name;
  }
}

TEST_F(SerialProgramTest, RefusesInvalidOptions) {
  for (const auto& [option, value, complaint] : std::vector<std::array<std::string, 3>>{
           {"--mode", "0990", "--mode: 0990: use an octal number"},
           {"--group", "root", "--group requires --mode"},
           {"--wait-mode", "snooze", "--wait-mode: snooze not in {adaptive,block,spin}"},
           {"--log-level", "loud",
            "--log-level: loud not in {trace,debug,info,warning,error,critical,off}"}}) {
    const auto server = start({option, value});

    const auto status = server->wait();

    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) != 0) << option;
    EXPECT_THAT(server->errors(), HasSubstr(complaint));
  }
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_F(SerialProgramTest, ReportsThePortThatItCannotOpen) {
  instrument_.unplug();
  const auto server = start();

  EXPECT_TRUE(hasExitedWith(server->wait(), 1));

  EXPECT_THAT(server->errors(), HasSubstr("mpf-serial-server: open " + path_ +
                                          ": No such file or directory; --wait waits for it"));
}

}  // namespace
}  // namespace mpf::test
