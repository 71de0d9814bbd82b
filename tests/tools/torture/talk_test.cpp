// SPDX-License-Identifier: MIT
// Talk: what it sends, and that it complains of each wrong end of a request.
#include "tools/torture/talk.h"

#include <array>
#include <fmt/format.h>
#include <optional>
#include <set>
#include <string>

#include "tests/tools/torture/talk_fixture.h"
#include "tools/torture/checks.h"

namespace mpf::torture {
namespace {

class TalkWithServer : public TalkTest {
 protected:
  void connect() {
    runUntil([&] { EXPECT_FALSE(server_->receive()); }, [&] { return talk_.isConnected(); });
  }
  // Returns the next request with this body that was sent as a message, or as one of many values.
  // The server refuses the requests before it.
  template <class Type>
  Message take(bool isOneOfMany = false) {
    for (;;) {
      talk_.sendSome();
      while (auto request = server_->receive()) {
        const bool hasMarks = request.getClientExtra() != 0;
        if (request.tryAs<Type>() != nullptr && hasMarks != isOneOfMany) return request;
      }
      dispatcher_.runOnce(Deadline::after(std::chrono::microseconds(100)));
    }
  }
  // Sends a reply, and waits until the talk has received it.
  void send(Message&& reply) {
    const auto before = replies();
    EXPECT_EQ(server_->reply(std::move(reply)), ReplyResult::sent);
    runUntil([] {}, [&] { return replies() != before; });
  }
  [[nodiscard]] std::string complaint() const { return world_->complaint(); }

  std::optional<MessageServer> server_{std::in_place, backplane_, "server"};
};

TEST_F(TalkWithServer, SendsNothingBeforeItIsConnected) {
  talk_.sendSome();

  EXPECT_EQ(talk_.open(), 0U);
}

TEST_F(TalkWithServer, AcceptsTheAnswersToItsRequests) {
  auto number = take<Int32>();
  const auto value = number.tryAs<Int32>()->value;
  EXPECT_EQ(number.tryAs<Int32>()->address, answerTo(value)) << "so that a server can check it";

  auto reply = *Int32Message::tryFrom(std::move(number));
  reply->value = answerTo(value);
  send(std::move(reply));

  auto array = *Float64ArrayMessage::tryFrom(take<Float64Array>());
  EXPECT_TRUE(holds(array.value(), array->extra));
  array->extra = answerTo(array->extra);
  send(std::move(array));

  EXPECT_EQ(talked_.server.load(), incarnationOf(backplane_.name(), "server"));
  EXPECT_EQ(complaint(), "");
}

TEST_F(TalkWithServer, ComplainsOfTheReplyToAnotherRequest) {
  auto request = *Int32Message::tryFrom(take<Int32>());
  const auto value = request->value;
  request->value = answerTo(value) + 1;

  send(std::move(request));

  EXPECT_EQ(complaint(),
            "the reply to " + std::to_string(value) + " is " + std::to_string(answerTo(value) + 1));
}

TEST_F(TalkWithServer, ComplainsOfADamagedArray) {
  auto request = *Float64ArrayMessage::tryFrom(take<Float64Array>());
  const auto value = request->extra;
  request->extra = answerTo(value);
  request.value().back() += 1;

  send(std::move(request));

  EXPECT_EQ(complaint(), "the reply to " + std::to_string(value) + " is damaged");
}

TEST_F(TalkWithServer, ComplainsOfAReplyOfAnotherType) {
  auto request = take<Int32>();
  const auto value = request.tryAs<Int32>()->value;
  auto reply = server_->allocReplyMessage<Float64>(request);

  send(std::move(reply));

  EXPECT_EQ(complaint(), "the reply to " + std::to_string(value) + " is not a reply of its server");
}

TEST_F(TalkWithServer, ComplainsOfASecondReply) {
  auto request = *Int32Message::tryFrom(take<Int32>());
  request->value = answerTo(request->value);
  auto second = server_->allocReplyMessage<Int32>(request);
  send(std::move(request));
  EXPECT_EQ(complaint(), "");

  EXPECT_EQ(server_->reply(std::move(second)), ReplyResult::sent);
  runUntil([] {}, [&] { return !complaint().empty(); });

  EXPECT_EQ(complaint(), "a reply or fate arrived for a request that had ended or was never sent");
}

TEST_F(TalkWithServer, ComplainsOfAValueThatDoesNotFollowItsFormerOne) {
  const auto request = take<Int32>();
  Int32 value{.cmd = static_cast<std::int32_t>(Request::answerMany),
              .value = answerTo(request.tryAs<Int32>()->value)};
  std::array<Int32, 3> values{value, value, value};
  for (std::int32_t i = 0; i < 3; ++i) values[static_cast<std::size_t>(i)].extra = i;
  ASSERT_EQ(server_->replyMany<Int32>(request, values).count, 3U);
  runUntil([] {}, [&] { return replies() != 0; });
  EXPECT_EQ(complaint(), "");

  value.extra = 4;
  ASSERT_EQ(server_->replyMany<Int32>(request, {&value, 1}).count, 1U);
  runUntil([] {}, [&] { return !complaint().empty(); });

  EXPECT_EQ(complaint(),
            fmt::format("value 4 of the answer {} does not follow its former one", value.value));
}

TEST_F(TalkWithServer, AcceptsTheAnswersToManyValues) {
  auto number = *Int32Message::tryFrom(take<Int32>(true));
  number->value = answerTo(number->value);
  send(std::move(number));
  auto other = *OutOfBandMessage::tryFrom(take<OutOfBand>(true));
  other->value = answerTo(other->value);
  send(std::move(other));

  EXPECT_EQ(complaint(), "");
}

TEST_F(TalkWithServer, ComplainsOfAWrongAnswerToOneOfManyValues) {
  auto other = *OutOfBandMessage::tryFrom(take<OutOfBand>(true));
  const auto value = other->value;
  other->value = answerTo(value) + 1;
  send(std::move(other));

  EXPECT_EQ(complaint(),
            "the reply to " + std::to_string(value) + " is " + std::to_string(answerTo(value) + 1));
}

TEST_F(TalkWithServer, ComplainsOfAnAnswerToAValueThatIsNotOpen) {
  const auto number = take<Int32>(true);
  auto reply = server_->allocReplyMessage<Int32>(number);
  reply->value = 1;

  EXPECT_EQ(server_->reply(std::move(reply)), ReplyResult::sent);
  runUntil([] {}, [&] { return !complaint().empty(); });

  EXPECT_EQ(complaint(), "a reply or fate arrived for a request that had ended or was never sent");
}

TEST_F(TalkWithServer, ADisconnectEndsAllRequestsAndIsCounted) {
  static_cast<void>(take<Int32>());
  talk_.sendSome();
  EXPECT_NE(talk_.open(), 0U);

  server_.reset();
  runUntil([] {}, [&] { return talked_.disconnects.load() != 0; });

  EXPECT_EQ(talk_.open(), 0U);
  EXPECT_FALSE(talk_.isConnected());
  EXPECT_EQ(complaint(), "");
}

TEST_F(TalkWithServer, ComplainsWhenAServerActedOnARequestThatItIsSaidNotToHaveReceived) {
  connect();
  const auto last = world_->nextValue();
  talk_.sendSome();
  for (int i = 1; i <= 100; ++i) world_->noteHandled(last + i);

  server_.reset();  // the requests in its ring were never received
  runUntil([] {}, [&] { return talked_.disconnects.load() != 0; });

  EXPECT_EQ(complaint(), "a request was reported as never taken, but a server had acted on it");
}

TEST_F(TalkWithServer, TheSabotageOfALostFateLeavesARequestOpen) {
  connect();
  talk_.sendSome();
  talk_.loseNextFate();

  server_.reset();
  runUntil([] {}, [&] { return talked_.disconnects.load() != 0; });

  EXPECT_EQ(talk_.open(), 1U);
  EXPECT_EQ(complaint(), "a disconnect was reported before the ends of 1 requests");
}

TEST_F(TalkWithServer, AsksItsServerToKillItself) {
  connect();

  ASSERT_TRUE(talk_.trySendDie());

  const auto request = server_->receive();
  ASSERT_NE(request.tryAs<Int32>(), nullptr);
  EXPECT_EQ(request.tryAs<Int32>()->cmd, static_cast<std::int32_t>(Request::die));
  EXPECT_EQ(talk_.open(), 1U);
}

// It sends arrays that need one slot, several slots or a chunk, and requests that the server keeps.
TEST_F(TalkWithServer, SendsRequestsOfEachKind) {
  std::set<std::size_t> lengths;
  std::set<std::int32_t> commands;
  std::size_t outOfBand = 0;

  runUntil(
      [&] {
        talk_.sendSome();
        while (const auto request = server_->receive()) {
          if (const auto* number = request.tryAs<Int32>()) commands.insert(number->cmd);
          else if (request.tryAs<OutOfBand>() != nullptr) ++outOfBand;
          else lengths.insert(request.valueAs<Float64Array>().size());
        }
      },
      [&] { return lengths.size() == 2 && commands.size() == 3 && outOfBand != 0; });

  EXPECT_EQ(lengths, (std::set<std::size_t>{9, 300}));
  EXPECT_EQ(commands, (std::set<std::int32_t>{static_cast<std::int32_t>(Request::answer),
                                              static_cast<std::int32_t>(Request::keep),
                                              static_cast<std::int32_t>(Request::answerMany)}));
}

TEST(TalkArrays, HoldTheElementsOfTheirValueOnly) {
  std::array<double, 3> array{elementOf(7, 0), elementOf(7, 1), elementOf(7, 2)};

  EXPECT_TRUE(holds(array, 7));
  EXPECT_FALSE(holds(array, 8));
  array[2] = elementOf(7, 1);
  EXPECT_FALSE(holds(array, 7));
}

}  // namespace
}  // namespace mpf::torture
