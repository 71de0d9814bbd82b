// SPDX-License-Identifier: MIT
// Each answer is returned to its own question, whatever an instrument does, and no request uses the
// line without end.
#include <atomic>
#include <cstdlib>
#include <fmt/format.h>
#include <iostream>
#include <mutex>

#include "drivers/serial/polled_serial_port.h"
#include "tests/server/programs/serial_server/fickle_line.h"
#include "tests/server/programs/serial_server/serial_fixture.h"
#include "tests/support/alarms.h"
#include "tests/support/victim.h"

namespace mpf::test {
namespace {

using namespace serial;
using testing::HasSubstr;

constexpr int kClients = 10;

// ---- a fickle instrument

constexpr int kUsualQuestions = 1200;

int questionsToAsk() {
  const char* set = std::getenv("MPF_TEST_QUESTIONS");
  return set != nullptr ? std::atoi(set) : kUsualQuestions;
}

struct Outcome {
  std::atomic<int> right = 0, wrong = 0, timeouts = 0, others = 0;
};

// Sends questions 0, 1, 2, ... of `next`, with random options and timeouts.
void askAll(const Backplane& backplane, std::atomic<int>& next, int end, Random& random,
            Outcome& outcome) {
  SyncClient client(backplane, "fickle");
  ASSERT_TRUE(client.connectWait(60s));
  for (int number = next++; number < end; number = next++) {
    Char8Array fields{.timeout = static_cast<std::int32_t>(random.below(4)),
                      .cmd = cmdWriteRead | cmdTimeoutMilliseconds};
    if (random.oneIn(2)) fields.cmd |= cmdFlush;
    if (random.oneIn(4)) fields.numberRetrys = static_cast<std::int32_t>(random.below(3));
    const auto reply = askSerial(client, fmt::format("Q{}\n", number), fields);
    if (reply.status == serialServerStatusTimeout) {
      ++outcome.timeouts;
    } else if (reply.status != serialServerStatusOK) {
      ++outcome.others;
    } else if (reply.text == fmt::format("A{}\r\n", number)) {
      ++outcome.right;
    } else {
      ++outcome.wrong;
      ADD_FAILURE() << "Q" << number << " was answered by " << testing::PrintToString(reply.text);
    }
  }
}

class FickleInstrumentTest : public testing::TestWithParam<bool> {};

// MPF_TEST_QUESTIONS=100000 sends more.
TEST_P(FickleInstrumentTest, NoQuestionGetsAnAnswerToAnother) {
  const std::chrono::seconds more((questionsToAsk() - kUsualQuestions) / 50);
  const Watchdog watchdog("fickle instrument test", Watchdog::kPatience + more);
  const LineLimits limits{.settleTime = 1ms, .quietTime = 2ms, .resyncLimit = 6ms};
  MoodCounts moods{};
  TestBackplane backplane;
  const ServerLog log("test", "off");
  Outcome outcome;
  {
    PolledSerialPort port(std::make_unique<FickleLine>(limits, 6, moods), false);
    MessageServer server(backplane, "fickle");
    SerialServer serial(
        server, port,
        {.bufferBytes = 100, .eom = "\r\n", .circularBuffer = GetParam(), .limits = limits}, log);
    std::jthread serving([&] { server.run(); });
    std::atomic<int> next = 0;
    std::vector<Random> randoms(kClients);
    {
      std::vector<std::jthread> clients;
      for (auto& random : randoms)
        clients.emplace_back([&] { askAll(backplane, next, questionsToAsk(), random, outcome); });
    }
    EXPECT_GT(alarmsOf(backplane, "fickle"), 0U);
    server.interrupt();
  }
  std::cout << fmt::format(
      "{} right, {} wrong, {} timeouts, {} others; questions in the order of Mood: {}\n",
      outcome.right.load(), outcome.wrong.load(), outcome.timeouts.load(), outcome.others.load(),
      testing::PrintToString(moods));
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_GT(outcome.right, questionsToAsk() / 2);
  for (const auto times : moods) EXPECT_GT(times, 0U);
}

INSTANTIATE_TEST_SUITE_P(Circular, FickleInstrumentTest, testing::Bool());

// ---- one answer that is late

class LateAnswerTest : public SerialServerTest, public testing::WithParamInterface<bool> {
 protected:
  // The server waits for the answer, however slow the machine is.
  void startWith(const LineLimits& limits = {.resyncLimit = 60s}) {
    start({.bufferBytes = 100, .eom = "\r\n", .circularBuffer = GetParam(), .limits = limits});
  }
  // A question whose answer arrives after its timeout. The instrument does not know the question:
  // it says the answer after the timeout, whenever it receives the question.
  void askTooEarly() {
    EXPECT_EQ(ask("LATE?\n", fieldsOf(cmdWriteRead, 50)).status, serialServerStatusTimeout);
    instrument_.say("late\r\n");
  }
  // Returns how many of `count` questions got the answer to another question.
  static int wrongOf(SyncClient& client, const std::string& who, int count) {
    int wrong = 0;
    for (int i = 0; i < count; ++i) {
      const auto word = who + std::to_string(i);
      const auto reply = askSerial(client, "ECHO " + word + "\n", fieldsOf(cmdWriteRead));
      EXPECT_EQ(reply.status, serialServerStatusOK);
      if (reply.text != word + "\r\n") ++wrong;
    }
    return wrong;
  }
};

TEST_P(LateAnswerTest, IsNotDelivered) {
  startWith();
  askTooEarly();

  EXPECT_EQ(wrongOf(client_, "a", 20), 0);
}

TEST_P(LateAnswerTest, IsNotDeliveredToAnyOfTenClients) {
  startWith();
  askTooEarly();

  std::atomic<int> wrong = 0;
  {
    std::vector<std::jthread> clients;
    for (int number = 0; number < kClients; ++number) {
      clients.emplace_back([&, number] {
        SyncClient client(backplane_, "serial[0]");
        wrong += wrongOf(client, std::string(1, static_cast<char>('a' + number)), 10);
      });
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST_P(LateAnswerTest, IsOneAlarmAndListenersReceiveIt) {
  std::mutex mutex;
  std::string seen;
  const auto tap = port_.attachTap([&](std::span<const PeekedByte> bytes) {
    const std::lock_guard lock(mutex);
    for (const auto& byte : bytes) {
      if (byte.direction == ByteDirection::received) seen += static_cast<char>(byte.value);
    }
  });
  startWith();
  askTooEarly();
  ASSERT_EQ(wrongOf(client_, "a", 2), 0);

  EXPECT_EQ(alarmsOf(backplane_, "serial[0]"), 1U);
  const std::lock_guard lock(mutex);
  EXPECT_THAT(seen, HasSubstr("late\r\n"));
}

TEST_P(LateAnswerTest, IsUsedAsTheAnswerOfARetry) {
  startWith();
  instrument_.behave({.isSilent = true});
  const std::jthread late([&] {
    while (port_.counters().timeouts == 0) std::this_thread::yield();
    instrument_.say("late\r\n");
  });
  auto fields = fieldsOf(cmdWriteRead, 50);
  fields.numberRetrys = 1;

  const auto reply = ask("ECHO late\n", fields);

  EXPECT_EQ(reply, (SerialReply{serialServerStatusOK, "late\r\n"}));
  EXPECT_EQ(port_.counters().bytesOut, 10U) << "sent once";
}

TEST_P(LateAnswerTest, SecondAnswersAreSurplus) {
  startWith();
  instrument_.behave({.answerEnd = "\r\nagain\r\n"});
  for (const std::string word : {"one", "two", "three"})
    EXPECT_EQ(ask("ECHO " + word + "\n", fieldsOf(cmdWriteRead)).text, word + "\r\n");

  EXPECT_GE(alarmsOf(backplane_, "serial[0]"), 2U);
}

// An instrument that never stops sending: its answers cannot be recognised.
TEST_P(LateAnswerTest, NothingIsSentWithoutSilence) {
  startWith({.quietTime = 10s, .resyncLimit = 10ms});
  ASSERT_EQ(ask("ECHO first\n", fieldsOf(cmdWriteRead)).status, serialServerStatusOK);
  instrument_.behave({.isSilent = true});
  ASSERT_EQ(ask("ECHO late\n", fieldsOf(cmdWriteRead, 50)).status, serialServerStatusTimeout);
  const auto sent = port_.counters().bytesOut;
  std::atomic<bool> isOver = false;
  std::jthread chatter([&] {
    while (!isOver) {
      instrument_.say("x");
      std::this_thread::sleep_for(1ms);
    }
  });

  EXPECT_EQ(ask("ECHO unsent\n", fieldsOf(cmdWriteRead)).status, serialServerStatusError);

  isOver = true;
  EXPECT_EQ(port_.counters().bytesOut, sent);
}

TEST_P(LateAnswerTest, AcknowledgementsOfWritesAreNoAlarm) {
  startWith();
  const std::string answer = "acknowledged\r\n";
  ASSERT_EQ(ask("ECHO acknowledged\n", fieldsOf(cmdWrite)).status, serialServerStatusOK);
  while (port_.counters().bytesIn < answer.size()) std::this_thread::yield();

  EXPECT_EQ(wrongOf(client_, "a", 1), 0);
  EXPECT_EQ(alarmsOf(backplane_, "serial[0]"), 0U);
}

INSTANTIATE_TEST_SUITE_P(Circular, LateAnswerTest, testing::Bool());

TEST_F(SerialServerTest, AnInstrumentThatSendsManyLinesIsReadLineByLine) {
  start();
  instrument_.behave({.answerEnd = "\r\nsecond\r\nthird\r\n"});

  EXPECT_EQ(ask("ECHO first\n", fieldsOf(cmdWriteRead)).text, "first\r\n");
  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "second\r\n");
  EXPECT_EQ(ask("", fieldsOf(cmdRead)).text, "third\r\n");
  EXPECT_EQ(alarmsOf(backplane_, "serial[0]"), 0U);
}

TEST_F(SerialServerTest, AWriteReadWithoutDataReadsTheBytesThatArriveLater) {
  start();
  ASSERT_EQ(ask("", fieldsOf(cmdWriteRead, 0)).status, serialServerStatusTimeout);

  EXPECT_EQ(ask("ECHO next\n", fieldsOf(cmdWriteRead)).text, "next\r\n");
}

// ---- requests without end

TEST_F(SerialServerTest, AnInvalidCommandIsNotRetried) {
  start();

  const auto reply = ask("", {.cmd = 5, .numberRetrys = INT32_MAX});

  EXPECT_EQ(reply.status, serialServerStatusError);
}

TEST_F(SerialServerTest, RetriesAreLimited) {
  start({.bufferBytes = 100,
         .eom = "\r\n",
         .circularBuffer = true,
         .limits = {.resyncLimit = 1ms, .maxRetries = 3}});
  instrument_.behave({.isSilent = true});
  auto fields = fieldsOf(cmdWriteRead, 1);
  fields.numberRetrys = INT32_MAX;

  EXPECT_EQ(ask("?\n", fields).status, serialServerStatusTimeout);

  EXPECT_EQ(port_.counters().bytesOut, 8U) << "sent four times";
}

TEST_F(SerialServerTest, TimeoutsAreLimitedWithTheRetries) {
  start({.bufferBytes = 100, .eom = "\r\n", .circularBuffer = true, .limits = {.maxTimeout = 1s}});
  instrument_.behave({.isSilent = true});

  const auto reply =
      ask("?\n", {.timeout = INT32_MAX, .cmd = cmdWriteRead, .numberRetrys = INT32_MAX});

  EXPECT_EQ(reply.status, serialServerStatusTimeout);
  EXPECT_EQ(port_.counters().bytesOut, 2U) << "sent once";
}

constexpr LineLimits kNoLimit{.resyncLimit = 10ms, .maxTimeout = 24h, .maxRetries = 1'000'000};

TEST_F(SerialServerTest, TheRequestOfAClientThatIsKilledEnds) {
  start({.bufferBytes = 100, .eom = "\r\n", .circularBuffer = true, .limits = kNoLimit});
  instrument_.behave({.isSilent = true});
  Victim victim("ask", backplane_.name(), {"serial[0]", "ECHO held\n"});
  ASSERT_TRUE(instrument_.waitForReceived("ECHO held\n"));

  victim.end(SIGKILL);
  instrument_.behave({});

  EXPECT_EQ(ask("ECHO free\n", fieldsOf(cmdWriteRead)).text, "free\r\n");
}

TEST_F(SerialServerTest, TheRequestOfAClientThatDisconnectsEnds) {
  start({.bufferBytes = 100, .eom = "\r\n", .circularBuffer = true, .limits = kNoLimit});
  instrument_.behave({.isSilent = true});
  {
    MessageClient client(backplane_, [](const Message&) {});
    client.bind("serial[0]");
    ASSERT_TRUE(client.connectWait(60s));
    auto message = client.alloc<Char8Array>(1);
    *message = {.timeout = INT32_MAX, .cmd = cmdRead, .length = 1};
    ASSERT_EQ(client.send(std::move(message)), SendResult::sent);
  }

  instrument_.behave({});
  EXPECT_EQ(ask("ECHO free\n", fieldsOf(cmdWriteRead)).text, "free\r\n");
}

// For example an IOC that sends its last command and exits.
TEST_F(SerialServerTest, AWriteContinuesWhenItsClientExits) {
  start();
  for (int i = 0; i < 20; ++i) {
    const auto text = fmt::format("OFF {}\n", i);
    {
      MessageClient client(backplane_, [](const Message&) {});
      client.bind("serial[0]");
      ASSERT_TRUE(client.connectWait(60s));
      auto message = client.alloc<Char8Array>(text.size());
      *message = {.timeout = 60, .cmd = cmdWrite, .length = message->length};
      std::copy(text.begin(), text.end(), message.value().begin());
      ASSERT_EQ(client.send(std::move(message)), SendResult::sent);
    }
    EXPECT_TRUE(instrument_.waitForReceived(text));
  }
}

}  // namespace
}  // namespace mpf::test
