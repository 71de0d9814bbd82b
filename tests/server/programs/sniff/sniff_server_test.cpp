// SPDX-License-Identifier: MIT
// Listeners of a serial line, while a client talks with the instrument at its far end.
#include "server/programs/sniff/sniff_server.h"

#include <numeric>
#include <vector>

#include "server/programs/serial_server/sniff_source.h"
#include "tests/server/programs/serial_server/serial_fixture.h"
#include "tests/support/victim.h"

namespace mpf::test {
namespace {

using namespace serial;

// As text: T before what was sent, R before what was received.
std::string textOf(std::span<const SniffRecord> records) {
  std::string text;
  auto last = SniffKind::breakSignal;
  for (const auto& record : records) {
    if (record.kind != last) (text += static_cast<char>(record.kind)) += ':';
    last = record.kind;
    text += static_cast<char>(record.value);
  }
  return text;
}

class Listener {
 public:
  explicit Listener(const Backplane& backplane) : client_(backplane, "serial[0].sniff") {}

  // Returns the status of the reply. Records carry `mark` from now on.
  std::int32_t start(std::int32_t mark = 0) {
    Int32Message request({.cmd = cmdSniffStart});
    request.setClientExtra(mark);
    return call(std::move(request)).status;
  }
  // Receives the messages before the reply, and returns the reply.
  Int32 stop() { return call(Int32Message({.cmd = cmdSniffStop})); }
  // Receives all messages that the server has sent until now.
  void takeWhatIsThere() { EXPECT_EQ(call(Int32Message({.cmd = 77})).status, sniffStatusError); }
  void takeUntil(std::size_t records) {
    while (records_.size() < records && !testing::Test::HasFatalFailure())
      keep(client_.receive(60s));
  }

  [[nodiscard]] std::span<const SniffRecord> records() const { return records_; }
  [[nodiscard]] std::string text() const { return textOf(records_); }
  [[nodiscard]] std::size_t lost() const { return lost_; }
  // For each record, the mark of the start that it belongs to.
  [[nodiscard]] const std::vector<std::int32_t>& marks() const { return marks_; }
  [[nodiscard]] SyncClient& client() { return client_; }

 private:
  Int32 call(Int32Message&& request) {
    auto answer = client_.call(std::move(request), 60s);
    EXPECT_TRUE(answer) << answer.why();
    while (auto message = client_.receive(0s)) keep(std::move(message));
    const auto* fields = answer.message().tryAs<Int32>();
    return fields != nullptr ? *fields : Int32{.status = -1};
  }
  void keep(Message&& message) {
    const auto mark = message.getClientExtra();
    const auto reply = Char8ArrayMessage::tryFrom(std::move(message));
    ASSERT_TRUE(reply);
    const auto records = tryReadRecords(*reply);
    ASSERT_TRUE(records);
    lost_ += static_cast<std::size_t>((*reply)->address);
    records_.insert(records_.end(), records->begin(), records->end());
    marks_.resize(records_.size(), mark);
  }

  SyncClient client_;
  std::vector<SniffRecord> records_;
  std::vector<std::int32_t> marks_;
  std::size_t lost_ = 0;
};

class SniffTest : public SerialServerTest {
 protected:
  static constexpr SniffBatching kAtOnce{.maxAge = 0ns};
  static constexpr SniffBatching kNever{.maxAge = 24h, .largeBytes = 1'000'000};

  void startWithListening(const SniffBatching& batching = {}) {
    start(
        {.bufferBytes = 100, .eom = "\r\n", .circularBuffer = true, .limits = {.settleTime = 0ms}});
    sniff_ = std::make_unique<SniffServer>(backplane_, "serial[0]", ServerOptions(),
                                           sniffSourceOf(port_), log_, batching);
    sniff_->start([] { FAIL() << "the sniff server failed"; });
  }
  // Sends one question. Returns the records that a listener must receive of it and its answer.
  std::string talk(const std::string& word) {
    EXPECT_EQ(ask("ECHO " + word + "\n", fieldsOf(cmdWriteRead)).text, word + "\r\n");
    return "T:ECHO " + word + "\nR:" + word + "\r\n";
  }
  void waitForListeners(std::size_t count) const {
    while (sniff_->listeners() != count) std::this_thread::yield();
  }

  std::unique_ptr<SniffServer> sniff_;
};

TEST_F(SniffTest, TwoListenersReceiveEveryByteInTheOrderOfTheLine) {
  startWithListening();
  Listener first(backplane_);
  Listener second(backplane_);
  ASSERT_EQ(first.start(), sniffStatusOK);
  ASSERT_EQ(second.start(), sniffStatusOK);
  const auto startNs = Clock::nowNs();

  std::string spoken;
  for (int i = 100; i < 200; ++i) {
    spoken += talk(std::to_string(i));
    // On a slow host each byte is a message of its own: more in sum than may wait for a listener.
    first.takeWhatIsThere();
    second.takeWhatIsThere();
  }

  constexpr std::size_t kBytesOfOne = 14;
  first.takeUntil(100 * kBytesOfOne);
  second.takeUntil(100 * kBytesOfOne);
  EXPECT_EQ(first.text(), spoken);
  EXPECT_EQ(first.lost(), 0U);
  EXPECT_TRUE(std::ranges::equal(first.records(), second.records()));
  EXPECT_TRUE(std::ranges::is_sorted(first.records(), {}, &SniffRecord::atNs));
  EXPECT_GE(first.records().front().atNs, startNs);
  EXPECT_LE(first.records().back().atNs, Clock::nowNs());
}

TEST_F(SniffTest, BytesThatTheLineDamagedAreMarked) {
  startWithListening(kAtOnce);
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);
  const std::vector<PeekedByte> bytes{{1, 'a', ByteDirection::sent, LineFault::none},
                                      {2, 'b', ByteDirection::received, LineFault::none},
                                      {3, 'c', ByteDirection::received, LineFault::parity},
                                      {4, 'd', ByteDirection::received, LineFault::framing},
                                      {5, 0, ByteDirection::received, LineFault::breakSignal}};

  port_.taps().show(bytes);

  listener.takeUntil(5);
  EXPECT_THAT(listener.records(), testing::ElementsAre(SniffRecord{1, SniffKind::sent, 'a'},
                                                       SniffRecord{2, SniffKind::received, 'b'},
                                                       SniffRecord{3, SniffKind::damaged, 'c'},
                                                       SniffRecord{4, SniffKind::damaged, 'd'},
                                                       SniffRecord{5, SniffKind::breakSignal, 0}));
}

TEST_F(SniffTest, ALargeBatchIsSentImmediately) {
  startWithListening({.maxAge = 24h, .largeBytes = 20});
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);

  const auto spoken = talk("large enough");

  listener.takeUntil(20);
  listener.takeWhatIsThere();
  EXPECT_TRUE(spoken.starts_with(listener.text()));
}

TEST_F(SniffTest, AStopReturnsEarlierBytesAndNothingFollowsIt) {
  startWithListening(kNever);
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);
  const auto before = talk("before");

  const auto reply = listener.stop();

  EXPECT_EQ(reply.status, sniffStatusOK);
  EXPECT_EQ(reply.address, 0);
  EXPECT_EQ(listener.text(), before);
  talk("after");
  EXPECT_EQ(listener.stop().status, sniffStatusNotListening);
  EXPECT_EQ(listener.text(), before);
}

TEST_F(SniffTest, AStopEndsTheListeningOfItsOwnClientOnly) {
  startWithListening(kNever);
  Listener listener(backplane_);
  Listener other(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);

  EXPECT_EQ(other.stop().status, sniffStatusNotListening);

  const auto spoken = talk("still heard");
  EXPECT_EQ(listener.stop().status, sniffStatusOK);
  EXPECT_EQ(listener.text(), spoken);
}

TEST_F(SniffTest, ALaterListenerReceivesLaterBytesOnly) {
  startWithListening(kNever);
  Listener early(backplane_);
  Listener late(backplane_);
  ASSERT_EQ(early.start(), sniffStatusOK);
  const auto before = talk("before");

  ASSERT_EQ(late.start(), sniffStatusOK);

  const auto after = talk("after");
  early.stop();
  late.stop();
  EXPECT_EQ(early.text(), before + after);
  EXPECT_EQ(late.text(), after);
}

TEST_F(SniffTest, ASecondStartReplacesTheFirst) {
  startWithListening(kNever);
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(1), sniffStatusOK);
  const auto before = talk("before");
  const std::vector<std::int32_t> marksBefore(before.size() - 4, 1);  // without "T:" and "R:"

  ASSERT_EQ(listener.start(2), sniffStatusOK);

  EXPECT_EQ(listener.marks(), marksBefore);
  const auto after = talk("after");
  listener.stop();
  EXPECT_EQ(listener.text(), before + after);
  EXPECT_EQ(listener.marks().back(), 2);
  EXPECT_EQ(listener.stop().status, sniffStatusNotListening);
}

TEST_F(SniffTest, OtherCommandsAndOtherTypesAreErrors) {
  startWithListening();
  SyncClient client(backplane_, "serial[0].sniff");

  auto error = client.call(Int32Message({.cmd = 3}), 60s);
  auto number = client.call(Float64Message(), 60s);

  EXPECT_EQ(error.message().tryAs<Int32>()->status, sniffStatusError);
  ASSERT_NE(number.message().tryAs<Float64>(), nullptr);
  EXPECT_EQ(number.message().tryAs<Float64>()->status, -1);
}

TEST_F(SniffTest, ThePortIsTappedWhileThereAreListeners) {
  startWithListening();
  EXPECT_TRUE(port_.taps().isEmpty());
  Listener first(backplane_);
  Listener second(backplane_);
  ASSERT_EQ(first.start(), sniffStatusOK);
  ASSERT_EQ(second.start(), sniffStatusOK);
  EXPECT_FALSE(port_.taps().isEmpty());

  first.stop();
  EXPECT_FALSE(port_.taps().isEmpty());
  second.stop();

  EXPECT_TRUE(port_.taps().isEmpty());
}

// It loses bytes and learns their number; other listeners are not affected.
TEST_F(SniffTest, AListenerThatDoesNotReceiveLosesBytes) {
  startWithListening(kAtOnce);
  Listener idle(backplane_);
  Listener busy(backplane_);
  ASSERT_EQ(idle.start(), sniffStatusOK);
  ASSERT_EQ(busy.start(), sniffStatusOK);

  constexpr std::size_t kBytesOfOne = 14;
  // a message each at least: more than can wait for one listener
  constexpr std::size_t kQuestions = 600;
  std::string spoken;
  for (std::size_t i = 0; i < kQuestions; ++i) {
    spoken += talk(std::to_string(100 + i));
    busy.takeUntil((i + 1) * kBytesOfOne);
  }
  EXPECT_EQ(busy.text(), spoken);
  EXPECT_EQ(busy.lost(), 0U);

  idle.takeWhatIsThere();
  EXPECT_EQ(idle.lost(), 0U);  // not reported yet
  const auto heard = idle.records().size();
  EXPECT_LT(heard, kQuestions * kBytesOfOne);
  EXPECT_GT(heard, 0U);
  EXPECT_TRUE(spoken.starts_with(idle.text()));
  talk("600");
  idle.takeUntil(heard + kBytesOfOne);
  EXPECT_EQ(heard + idle.lost(), kQuestions * kBytesOfOne);
}

TEST_F(SniffTest, AStopCountsTheBytesMissingAtTheEnd) {
  startWithListening(kAtOnce);
  Listener idle(backplane_);
  Listener busy(backplane_);
  ASSERT_EQ(idle.start(), sniffStatusOK);
  ASSERT_EQ(busy.start(), sniffStatusOK);
  constexpr std::size_t kBytesOfOne = 14;
  constexpr std::size_t kQuestions = 600;
  for (std::size_t i = 0; i < kQuestions; ++i) {
    talk(std::to_string(100 + i));
    busy.takeUntil((i + 1) * kBytesOfOne);
  }

  const auto reply = idle.stop();

  EXPECT_GT(reply.address, 0);
  EXPECT_EQ(idle.records().size() + static_cast<std::size_t>(reply.address),
            kQuestions * kBytesOfOne);
}

TEST_F(SniffTest, BytesThatTheServerLostAreReportedToAllListeners) {
  startWithListening({.maxAge = 24h, .largeBytes = 1'000'000, .maxBytes = 10});
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);
  const auto spoken = talk("longer than ten");

  const auto reply = listener.stop();

  EXPECT_EQ(listener.records().size(), 10U);
  EXPECT_EQ(10U + static_cast<std::size_t>(reply.address), spoken.size() - 4);
}

TEST_F(SniffTest, AListenerThatIsKilledOrDisconnectsIsRemoved) {
  startWithListening();
  Victim killed("listen", backplane_.name());
  auto leaving = std::make_unique<Listener>(backplane_);
  Listener staying(backplane_);
  ASSERT_EQ(leaving->start(), sniffStatusOK);
  ASSERT_EQ(staying.start(), sniffStatusOK);
  waitForListeners(3);

  killed.end(SIGKILL);
  waitForListeners(2);
  leaving.reset();
  waitForListeners(1);

  const auto spoken = talk("still heard");
  staying.takeUntil(spoken.size() - 4);
  EXPECT_EQ(staying.text(), spoken);
  EXPECT_EQ(staying.stop().status, sniffStatusOK);
  EXPECT_TRUE(port_.taps().isEmpty());
}

TEST_F(SniffTest, ManyRequestsOfAClientDoNotDelayListeners) {
  constexpr std::size_t kRequests = 50;
  std::vector<std::int64_t> answersNs;
  Dispatcher dispatcher(backplane_);
  MessageClient busy(dispatcher, [&](const Message& message) {
    if (message.tryAs<Int32>() != nullptr) answersNs.push_back(message.getTimeStampNs());
  });
  // The server calls it for the first listener: a byte is there, and many requests wait behind it.
  const auto source = [&](const std::function<void(std::span<const SniffBytes>)>& show) {
    for (std::size_t i = 0; i < kRequests; ++i)
      EXPECT_EQ(busy.send(Int32Message({.cmd = 77})), SendResult::sent);
    show(std::vector<SniffBytes>(1));
    return std::make_shared<int>();
  };
  SniffServer server(backplane_, "line", {.stampsReplies = true}, source, log_, kAtOnce);
  server.start([] { FAIL() << "the sniff server failed"; });
  busy.bind("line.sniff");
  while (!busy.isConnected()) dispatcher.runOnce();
  SyncClient listener(backplane_, "line.sniff");

  ASSERT_TRUE(listener.call(Int32Message({.cmd = cmdSniffStart}), 60s));
  const auto bytes = listener.receive(60s);

  while (answersNs.size() < kRequests) dispatcher.runOnce();
  EXPECT_NE(bytes.getTimeStampNs(), 0);
  EXPECT_LT(bytes.getTimeStampNs(), answersNs.back());
}

TEST_F(SniffTest, TheServerMayEndDuringListeningOnABusyLine) {
  startWithListening(kAtOnce);
  Listener listener(backplane_);
  ASSERT_EQ(listener.start(), sniffStatusOK);
  talk("before");

  sniff_.reset();

  talk("after");
  EXPECT_TRUE(port_.taps().isEmpty());
}

}  // namespace
}  // namespace mpf::test
