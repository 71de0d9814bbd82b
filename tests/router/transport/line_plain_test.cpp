// SPDX-License-Identifier: MIT
// Line: plain items, between others, in parts, and at the end of a connection.
#include <malloc.h>

#include "tests/router/transport/line_fixture.h"
#include "tests/shm/receiver.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {
namespace {

using router::PlainItem;
using router::PlainRun;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"  // kj::Own destroys the dynamic type
// Records the order of reads and writes.
class Recording final : public kj::AsyncIoStream {
 public:
  Recording(kj::Own<kj::AsyncIoStream> stream, std::vector<std::string>& calls)
      : stream_(kj::mv(stream)), calls_(calls) {}
  kj::Promise<std::size_t> tryRead(void* buffer, std::size_t least, std::size_t most) override {
    calls_.emplace_back("read");
    return stream_->tryRead(buffer, least, most);
  }
  kj::Promise<void> write(const void* buffer, std::size_t size) override {
    calls_.emplace_back("write");
    return stream_->write(buffer, size);
  }
  kj::Promise<void> write(kj::ArrayPtr<const kj::ArrayPtr<const kj::byte>> pieces) override {
    calls_.emplace_back("write");
    return stream_->write(pieces);
  }
  kj::Promise<void> whenWriteDisconnected() override { return stream_->whenWriteDisconnected(); }
  void shutdownWrite() override { stream_->shutdownWrite(); }

 private:
  kj::Own<kj::AsyncIoStream> stream_;
  std::vector<std::string>& calls_;
};
#pragma GCC diagnostic pop

class LinePlainTest : public LineTest {
 protected:
  void SetUp() override {
    onPlain_ = [this](PlainItem& item) {
      said_.push_back("plain " + std::to_string(item.requestId));
    };
  }
  static PlainItem plain(std::uint32_t id) {
    return {.isRequest = true, .client = 1, .requestId = id, .message = Int32Message({.value = 1})};
  }
  static Bytes plainFrame(std::uint32_t first, std::uint32_t items) {
    PlainRun run;
    for (std::uint32_t id = first; id < first + items; ++id) run.append(plain(id));
    run.buildHead();
    Bytes bytes(run.head().begin(), run.head().end());
    bytes.insert(bytes.end(), run.payload().begin(), run.payload().end());
    return bytes;
  }
  static Fill request(std::uint32_t id, std::uint64_t withinNs) {
    return [id, withinNs](wire::Item::Builder item) {
      auto request = item.initRequest();
      request.setRequestId(id);
      request.setTakeWithinNs(withinNs);
      request.initMessage().initInt32();
    };
  }
};

TEST_F(LinePlainTest, KeepsTheOrderOfPlainItemsAndOthers) {
  startGreeted();

  send(frameOf({request(1, 0), request(2, 99), [](wire::Item::Builder item) { item.setClose(3); },
                request(4, 0)}));

  EXPECT_THAT(said_, ElementsAre("plain 1", HasSubstr("requestId = 2"), "(close = 3)", "plain 4"));
  EXPECT_EQ(row_.messagesReceived, 3u);
}

TEST_F(LinePlainTest, ReportsItemsTogetherInTheirOrder) {
  onPlainItems_ = [this](const router::PlainItems& items) {
    std::string text = "together";
    for (std::size_t at = 0; at < items.run.size(); ++at)
      text += ' ' + std::to_string(items[at].requestId);
    said_.push_back(text);
  };
  startGreeted();

  send(joined({plainFrame(1, 18), plainFrame(19, 1),
               frameOf({request(20, 0), request(21, 0), request(22, 99), request(23, 0)})}));

  EXPECT_THAT(said_,
              ElementsAre("together 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16", "together 17 18",
                          "plain 19", "together 20 21", HasSubstr("requestId = 22"), "plain 23"));
  EXPECT_EQ(row_.messagesReceived, 23u);
  hangUp();
}

TEST_F(LinePlainTest, FramesMayArriveInAnyTwoParts) {
  const auto bytes = joined({plainFrame(1, 2), plainFrame(3, 1), plainFrame(4, 2)});
  for (std::size_t cut = 1; cut < bytes.size(); cut += 5) {
    startGreeted();

    const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(cut);
    send(Bytes(bytes.begin(), middle));
    send(Bytes(middle, bytes.end()));

    ASSERT_THAT(said_, ElementsAre("plain 1", "plain 2", "plain 3", "plain 4", "plain 5"))
        << "cut after " << cut << " bytes";
    restart();
  }
}

TEST_F(LinePlainTest, ReportsOnceThatTheItemsThatArrivedWereHandled) {
  int reports = 0;
  onHandled_ = [&] { ++reports; };
  startGreeted();
  reports = 0;

  const auto bytes = joined({plainFrame(1, 2), plainFrame(3, 1)});
  send({bytes.begin(), bytes.begin() + 8});
  EXPECT_EQ(reports, 0) << "a part of a frame";
  send({bytes.begin() + 8, bytes.end()});

  EXPECT_THAT(said_, ElementsAre("plain 1", "plain 2", "plain 3"));
  EXPECT_EQ(reports, 1);
  hangUp();
}

// A read that finds nothing would delay the answer.
TEST_F(LinePlainTest, WritesTheAnswersBeforeItReadsAgain) {
  std::vector<std::string> calls;
  pipe_.ends[0] = kj::heap<Recording>(kj::mv(pipe_.ends[0]), calls);
  onPlain_ = [this](const PlainItem& item) { line_->send(plain(item.requestId)); };
  startGreeted();
  calls.clear();

  for (std::uint32_t id = 1; id <= 2; ++id) {
    send(plainFrame(id, 1));
    EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = " + std::to_string(id))));
  }

  EXPECT_THAT(calls, ElementsAre("write", "read", "write", "read"));
  hangUp();
}

TEST_F(LinePlainTest, KeepsNoMemoryOfFramesThatWereHandled) {
  constexpr std::uint32_t kFrames = 5000;
  startGreeted();
  const auto handle = [this] {
    for (std::uint32_t id = 1; id <= kFrames; ++id) {
      send(plainFrame(id, 1));
      said_.clear();
    }
    return ::mallinfo2().uordblks;
  };

  const auto before = handle();
  const auto after = handle();

  EXPECT_LT(after, before + kFrames * sizeof(void*));
}

TEST_F(LinePlainTest, HandlesNothingOfAFrameThatEndsEarly) {
  startGreeted();
  auto bytes = joined({plainFrame(1, 2), plainFrame(3, 100)});
  bytes.resize(bytes.size() - 8);

  send(bytes);
  close();

  EXPECT_THAT(said_, ElementsAre("plain 1", "plain 2"));
  EXPECT_EQ(end_, "the peer closed the connection");
}

TEST_F(LinePlainTest, HandlesNothingBehindAProtocolError) {
  onPlain_ = [this](PlainItem& item) {
    if (item.requestId == 3) throw ProtocolError(FarewellCode::LIMIT, "too many");
    said_.push_back("plain " + std::to_string(item.requestId));
  };
  startGreeted();

  send(plainFrame(1, 5));

  EXPECT_THAT(farewell(), AllOf(HasSubstr("code = limit"), HasSubstr("too many")));
  EXPECT_THAT(said_, ElementsAre("plain 1", "plain 2"));
}

// A router that hands each plain item to a receiver on its host.
class LineNoticesTest : public LinePlainTest {
 protected:
  void SetUp() override {
    onPlain_ = [this](PlainItem&) {
      receiver_.sendOne();
      noteNotice();
    };
    onItem_ = [this](wire::Item::Reader) { noteNotice(); };
    startGreeted();
  }
  void noteNotice() { said_.emplace_back(receiver_.wasNotified() ? "notified" : "delayed"); }

  TestBackplane backplane_;
  Receiver receiver_{backplane_, "receiver"};
};

TEST_F(LineNoticesTest, AreDelayedToTheEndOfARun) {
  send(joined({plainFrame(1, 1), plainFrame(2, 2)}));

  EXPECT_THAT(said_, ElementsAre("delayed", "delayed", "delayed"));
  EXPECT_TRUE(receiver_.wasNotified());
}

TEST_F(LineNoticesTest, PrecedeAnItemThatIsNotPlain) {
  send(frameOf({request(1, 0), [](wire::Item::Builder item) { item.setClose(3); }, request(4, 0)}));

  EXPECT_THAT(said_, ElementsAre("delayed", "notified", "(close = 3)", "delayed"));
  EXPECT_TRUE(receiver_.wasNotified());
}

TEST_F(LineNoticesTest, PrecedeTheItemsOfAnotherClient) {
  PlainRun run;
  for (const std::uint32_t client : {1u, 1u, 2u}) {
    auto item = plain(1);
    item.client = client;
    run.append(item);
  }
  run.buildHead();

  send(joined({Bytes(run.head().begin(), run.head().end()),
               Bytes(run.payload().begin(), run.payload().end())}));

  EXPECT_THAT(said_, ElementsAre("delayed", "delayed", "notified"));
}

TEST_F(LineNoticesTest, FollowAnItemThatIsNotPlainAtOnce) {
  onItem_ = [this](wire::Item::Reader) { receiver_.sendOne(); };

  send(frameOf({[](wire::Item::Builder item) { item.setClose(3); }, request(4, 0)}));

  EXPECT_THAT(said_, ElementsAre("(close = 3)", "notified"));
}

TEST_F(LineNoticesTest, AreGivenAfterAProtocolError) {
  onItem_ = [this](wire::Item::Reader) {
    receiver_.sendOne();
    throw ProtocolError(FarewellCode::LIMIT, "too many");
  };

  send(frameOf({[](wire::Item::Builder item) { item.setClose(3); }}));

  EXPECT_TRUE(receiver_.wasNotified());
}

TEST_F(LinePlainTest, IsNoGreeting) {
  start();
  EXPECT_THAT(receive(), ElementsAre(HasSubstr("greeting = ")));

  send(plainFrame(1, 1));

  EXPECT_THAT(farewell(), HasSubstr("the first item is not a greeting"));
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(LinePlainTest, GoesToTheUsualFunctionWithoutOneOfItsOwn) {
  onPlain_ = nullptr;
  startGreeted();

  send(plainFrame(7, 1));

  EXPECT_THAT(said_, ElementsAre(HasSubstr("requestId = 7")));
}

TEST_F(LinePlainTest, SendsRunsBetweenOtherItemsInOrder) {
  startGreeted();
  line_->send(plain(1));
  settle();  // it is being written

  line_->send(plain(2));
  line_->send([](wire::Item::Builder item) { item.setClose(3); });
  for (std::uint32_t id = 4; id <= 1000; ++id) line_->send(plain(id));

  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 1,")));
  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 2,")));
  EXPECT_THAT(receive(), ElementsAre("(close = 3)"));
  for (std::uint32_t id = 4; id <= 1000;) {
    for (const auto& item : receive())
      ASSERT_THAT(item, HasSubstr("requestId = " + std::to_string(id++) + ","));
  }
}

TEST_F(LinePlainTest, ReturnsRequestsThatWereNeverWritten) {
  startGreeted();
  line_->send(plain(1));
  settle();  // it is being written, and may arrive
  line_->send(plain(2));
  line_->send(LineTest::request(3));
  line_->send(plain(4));

  peer_ = nullptr;
  settle();
  line_->send(plain(5));
  MessageRun run(MessageType::int32);
  for (const std::uint32_t id : {6u, 7u}) {
    run.add(EnvelopeWords::of({.requestId = id}, 1, layout::kFirstSlotBodyBytes));
    run.add(FirstBody{});
  }
  line_->send(router::PlainItems{true, false, 1, run});

  std::vector<std::uint32_t> ids;
  for (const auto& request : line_->takeUnsentRequests()) ids.push_back(request.requestId);
  EXPECT_THAT(ids, ElementsAre(2, 3, 4, 5, 6, 7));
}

TEST_F(LinePlainTest, HasNoRoomWhileItsQueueIsFull) {
  limits_.queueSize = 3;
  startGreeted();
  line_->send(plain(1));
  settle();  // it is being written
  for (std::uint32_t id = 2; id <= 4; ++id) {
    EXPECT_TRUE(line_->hasRoom());
    line_->send(plain(id));
  }

  EXPECT_FALSE(line_->hasRoom());
  EXPECT_THAT(receive(), SizeIs(1));
  EXPECT_TRUE(line_->hasRoom());
}

}  // namespace
}  // namespace mpf::test
