// SPDX-License-Identifier: MIT
// Echo: how it answers, and that it complains of each damaged request.
#include "tools/torture/echo.h"

#include <sys/wait.h>

#include <vector>

#include "tests/tools/torture/talk_fixture.h"
#include "tools/torture/processes.h"

namespace mpf::torture {
namespace {

class EchoTest : public TalkTest {
 protected:
  void SetUp() override {
    client_.bind("server");
    run([&] { return client_.isConnected(); });
  }
  template <class Condition>
  void run(const Condition& condition) {
    runUntil([&] { echo_.handleAll(); }, condition);
  }
  // A request that the server has not seen before.
  Int32Message number(Request request) {
    const auto value = world_->nextValue();
    return Int32Message(
        {.cmd = static_cast<std::int32_t>(request), .address = answerTo(value), .value = value});
  }
  Float64ArrayMessage array(std::size_t length) {
    const auto value = world_->nextValue();
    auto array = client_.alloc<Float64Array>(length);
    array->extra = value;
    for (std::size_t i = 0; i < length; ++i) array.value()[i] = elementOf(value, i);
    return array;
  }
  // Sends a request and returns its reply or fate.
  Message call(Message&& request) {
    const auto before = ends_.size();
    EXPECT_EQ(client_.send(std::move(request)), SendResult::sent);
    run([&] { return ends_.size() != before; });
    return std::move(ends_.back());
  }

  Echo echo_{backplane_, "server", *world_, WaitMode::block};
  std::vector<Message> ends_;
  MessageClient client_{dispatcher_, [this](Message&& message) {
                          if (message.getType() != MessageType::connect)
                            ends_.push_back(std::move(message));
                        }};
};

TEST_F(EchoTest, ATalkWithItNeverComplains) {
  run([&] {
    talk_.sendSome();
    return replies() >= 500;
  });

  EXPECT_EQ(world_->complaint(), "");
}

TEST_F(EchoTest, AnswersANumber) {
  auto request = number(Request::answer);
  const auto value = request->value;

  const auto reply = call(std::move(request));

  ASSERT_NE(reply.tryAs<Int32>(), nullptr);
  EXPECT_EQ(reply.tryAs<Int32>()->value, answerTo(value));
}

TEST_F(EchoTest, AnswersRequestsThatWaitTogether) {
  std::vector<OutOfBand> values(5);
  for (auto& value : values) {
    value.value = world_->nextValue();
    value.address = answerTo(value.value);
  }
  ASSERT_EQ(client_.sendMany<OutOfBand>(values).count, 5U);

  run([&] { return ends_.size() == 5; });

  for (std::size_t i = 0; i < 5; ++i) {
    ASSERT_NE(ends_[i].tryAs<OutOfBand>(), nullptr);
    EXPECT_EQ(ends_[i].tryAs<OutOfBand>()->value, answerTo(values[i].value));
  }
  EXPECT_EQ(world_->complaint(), "");
}

TEST_F(EchoTest, ComplainsOfDamagedRequestsThatWaitTogether) {
  std::vector<OutOfBand> values(2);
  ASSERT_EQ(client_.sendMany<OutOfBand>(values).count, 2U);

  run([&] { return ends_.size() == 2; });

  EXPECT_EQ(world_->complaint(), "request 0 is damaged");
}

TEST_F(EchoTest, AnswersWithManyValuesInOrder) {
  auto request = number(Request::answerMany);
  const auto value = request->value;
  ASSERT_EQ(client_.send(std::move(request)), SendResult::sent);

  run([&] { return ends_.size() == 24; });

  for (std::size_t i = 0; i < ends_.size(); ++i) {
    ASSERT_NE(ends_[i].tryAs<Int32>(), nullptr);
    EXPECT_EQ(ends_[i].tryAs<Int32>()->value, answerTo(value));
    EXPECT_EQ(ends_[i].tryAs<Int32>()->extra, static_cast<std::int32_t>(i));
  }
}

// Every third array is answered with a new message, the others in their own memory.
TEST_F(EchoTest, AnswersArraysWithTheirElements) {
  for (int i = 0; i < 4; ++i) {
    auto request = array(300);
    const auto value = request->extra;

    const auto reply = call(std::move(request));

    ASSERT_NE(reply.tryAs<Float64Array>(), nullptr);
    EXPECT_EQ(reply.tryAs<Float64Array>()->extra, answerTo(value));
    EXPECT_EQ(reply.valueAs<Float64Array>().size(), 300U);
    EXPECT_TRUE(holds(reply.valueAs<Float64Array>(), value));
  }
}

TEST_F(EchoTest, AnswersAKeptRequestWhenTheNextOneArrives) {
  auto first = number(Request::keep);
  const auto value = first->value;
  ASSERT_EQ(client_.send(std::move(first)), SendResult::sent);

  const auto reply = call(number(Request::keep));

  ASSERT_NE(reply.tryAs<Int32>(), nullptr);
  EXPECT_EQ(reply.tryAs<Int32>()->value, answerTo(value));
}

TEST_F(EchoTest, NotesEachRequestThatItHandles) {
  auto request = number(Request::answer);
  const auto value = request->value;
  static_cast<void>(call(std::move(request)));

  world_->noteNeverTaken(value);

  EXPECT_EQ(world_->complaint(),
            "a request was reported as never taken, but a server had acted on it");
}

TEST_F(EchoTest, ComplainsOfADamagedNumber) {
  auto request = number(Request::answer);
  const auto value = request->value;
  request->address += 1;

  static_cast<void>(call(std::move(request)));

  EXPECT_EQ(world_->complaint(), "request " + std::to_string(value) + " is damaged");
}

TEST_F(EchoTest, ComplainsOfADamagedArray) {
  auto request = array(300);
  const auto value = request->extra;
  request.value()[299] += 1;

  static_cast<void>(call(std::move(request)));

  EXPECT_EQ(world_->complaint(), "request " + std::to_string(value) + " is damaged");
}

TEST_F(EchoTest, ComplainsOfARequestOfAnotherType) {
  static_cast<void>(call(Float64Message({.value = 1})));

  EXPECT_EQ(world_->complaint(), "a server received a message of a type that no client sends");
}

TEST_F(EchoTest, RunsUntilItsBoardSaysToLeave) {
  Board board;
  board.leave.store(1);

  echo_.run(board, false);
  echo_.run(board, true);
}

// The server is a process of its own, and dies in the middle of its work.
TEST(EchoProcess, KillsItselfWhenAClientAsksForIt) {
  const test::Watchdog watchdog("echo process");
  const test::TestBackplane backplane;
  const SharedWorld world;
  Processes processes;
  const auto server = processes.start([&] {
    Echo echo(Backplane::named(backplane.name()), "server", *world, WaitMode::block);
    const Board neverLeave;
    echo.run(neverLeave, true);
    return 0;
  });
  Talked talked;
  Dispatcher dispatcher(backplane);
  Talk talk(dispatcher, *world, talked, "server", 1);
  while (!talk.isConnected()) dispatcher.runOnce(Deadline::after(std::chrono::milliseconds(1)));

  ASSERT_TRUE(talk.trySendDie());

  while (!processes.hasEnded(server)) processes.handleEvents(std::chrono::hours(1));
  const auto status = processes.takeStatus(server);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGKILL);
  while (talked.disconnects.load() == 0)
    dispatcher.runOnce(Deadline::after(std::chrono::milliseconds(1)));
  EXPECT_EQ((*world).complaint(), "");
}

}  // namespace
}  // namespace mpf::torture
