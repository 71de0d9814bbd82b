// SPDX-License-Identifier: MIT
// TapSession: follows a server and its clients, which are in this thread.
#include "tools/tap/tap_session.h"

#include <algorithm>
#include <stdexcept>

#include "tests/tools/one_link.h"

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

// Collects the calls as texts: "opened dac", "request 5", "reply 6", "missed 7", "closed".
class Collector final : public TapSink {
 public:
  void opened(std::int64_t /*atNs*/, const TappedLink& link) override {
    if (refuses) throw std::runtime_error("disk full");
    calls.push_back("opened " + link.server);
    opened_ = link;
  }
  void message(std::int64_t /*atNs*/, const TappedLink& /*link*/,
               const TappedMessage& message) override {
    calls.push_back((message.direction == Direction::request ? "request " : "reply ") +
                    std::to_string(message.message.tryAs<Int32>()->value));
  }
  void missed(std::int64_t /*atNs*/, const TappedLink& /*link*/, std::uint64_t messages) override {
    calls.push_back("missed " + std::to_string(messages));
  }
  void closed(std::int64_t /*atNs*/, const TappedLink& /*link*/) override {
    calls.emplace_back("closed");
  }
  [[nodiscard]] const TappedLink& lastLink() const noexcept { return opened_; }
  // The calls since this function was last called.
  std::vector<std::string> take() { return std::exchange(calls, {}); }

  bool refuses = false;
  std::vector<std::string> calls;

 private:
  TappedLink opened_;
};

class TapSessionTest : public test::OneLinkTest {
 protected:
  void begin(const std::string& link = {}, std::uint64_t count = UINT64_MAX) {
    session_.emplace(TapSelection{name(), "dac", 2, link, count}, sink_);
  }
  void runUntil(const std::function<bool()>& isDone) {
    while (!isDone()) {
      if (!session_->runOnce()) session_->pause(1ms);
    }
  }
  // Sends a value and lets the server reply.
  void exchange(std::int32_t value) {
    sendValue(value);
    handle(1);
  }

  Collector sink_;
  std::optional<TapSession> session_;
};

TEST_F(TapSessionTest, FollowsAnExistingLinkFromNowOn) {
  connect();
  exchange(1);
  begin();
  EXPECT_TRUE(session_->isServerThere());
  EXPECT_EQ(session_->links(), 1U);
  EXPECT_THAT(sink_.take(), ElementsAre("opened dac"));
  EXPECT_EQ(sink_.lastLink().location, 2);
  EXPECT_EQ(sink_.lastLink().clientPid, ::getpid());
  EXPECT_THAT(sink_.lastLink().client, StartsWith("tools_unit_test"));

  exchange(5);

  EXPECT_TRUE(session_->runOnce());
  EXPECT_THAT(sink_.take(), ElementsAre("request 5", "reply 6"));
  EXPECT_FALSE(session_->runOnce());
  EXPECT_THAT(sink_.take(), IsEmpty());
  EXPECT_EQ(session_->seen(), 2U);
  EXPECT_EQ(session_->missed(), 0U);
}

TEST_F(TapSessionTest, FollowsALaterLinkFromItsFirstMessage) {
  openServer();
  begin();
  EXPECT_EQ(session_->links(), 0U);

  connectClient();
  exchange(5);
  runUntil([&] { return session_->seen() == 2; });

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "reply 6"));
}

TEST_F(TapSessionTest, WaitsForAnAbsentServerAndFollowsItAfterARestart) {
  begin();
  EXPECT_FALSE(session_->isServerThere());

  connect();
  exchange(5);
  runUntil([&] { return session_->seen() == 2; });
  EXPECT_TRUE(session_->isServerThere());
  client_.reset();
  server_.reset();
  connect();
  exchange(7);
  runUntil([&] { return session_->seen() == 4 && session_->links() == 1; });

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "reply 6", "closed",
                                        "opened dac", "request 7", "reply 8"));
}

TEST_F(TapSessionTest, ReadsTheRestOfALinkThatIsOver) {
  connect();
  begin();
  sendValue(5);

  client_.reset();
  runUntil([&] { return session_->links() == 0; });

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "closed"));
}

TEST_F(TapSessionTest, FinishReadsTheRestWithoutClosing) {
  connect();
  begin();
  exchange(5);

  session_->finish();

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "reply 6"));
  EXPECT_EQ(session_->seen(), 2U);
}

TEST_F(TapSessionTest, FinishReadsALinkThatIsNew) {
  openServer();
  begin();
  connectClient();
  exchange(5);

  session_->finish();

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "reply 6"));
}

TEST_F(TapSessionTest, FollowsOnlyTheChosenLink) {
  connect();
  const auto link = linkName().substr(linkName().rfind('.') + 1);

  for (const auto& digits : {link, link.substr(0, 6)}) {
    begin(digits);
    EXPECT_EQ(session_->links(), 1U) << digits;
  }
  begin(link + "0");
  EXPECT_EQ(session_->links(), 0U);
}

TEST_F(TapSessionTest, ShowsNoMoreMessagesThanItShould) {
  connect();
  begin({}, 3);
  exchange(5);
  exchange(7);

  session_->runOnce();
  session_->finish();

  EXPECT_THAT(sink_.take(), ElementsAre("opened dac", "request 5", "reply 6", "request 7"));
  EXPECT_EQ(session_->seen(), 3U);
}

// Its name appears and is gone before the session looks.
TEST_F(TapSessionTest, CountsLinksThatEndedBeforeItLooked) {
  openServer();
  begin();

  connectClient();
  client_.reset();
  runUntil([&] { return session_->goneLinks() == 1; });

  EXPECT_THAT(sink_.take(), IsEmpty());
}

// The number is reported when two calls have found the same, and again when it has grown.
TEST_F(TapSessionTest, ReportsHowManyMessagesItMissed) {
  connect();
  begin();
  sink_.take();
  constexpr std::uint64_t kMessages = 500;  // more than the rings hold
  for (std::uint64_t i = 0; i < kMessages; ++i) {
    exchange(0);
    takeReplies(static_cast<int>(i + 1));
  }

  while (session_->runOnce()) continue;
  EXPECT_FALSE(session_->runOnce());

  EXPECT_GT(session_->missed(), 0U);
  EXPECT_EQ(session_->seen() + session_->missed(), 2 * kMessages);
  const auto report = "missed " + std::to_string(session_->missed());
  EXPECT_EQ(std::ranges::count(sink_.calls, report), 1);
  EXPECT_EQ(sink_.calls.back(), report);
}

TEST_F(TapSessionTest, ReportsALinkThatCannotBeReadOnce) {
  connect();
  const auto bad =
      SegmentName::link(name(), SegmentName::tryParse(linkName())->serverWindow, 0xbad);
  ASSERT_TRUE(createPage(layout::SegmentKind::link).tryPublish(bad));

  begin();
  segments::remove(bad);  // the same name once more: the session looks at it again
  ASSERT_TRUE(createPage(layout::SegmentKind::link).tryPublish(bad));
  session_->runOnce();

  EXPECT_EQ(session_->links(), 1U) << "the other link";
  EXPECT_THAT(session_->problems(), ElementsAre(StartsWith(segments::path(bad) + ": not a link")));
  segments::remove(bad);
}

TEST_F(TapSessionTest, RefusesInvalidNames) {
  EXPECT_THROW(TapSession(TapSelection{"a.b", "dac", 0, {}}, sink_), std::invalid_argument);
  EXPECT_THROW(TapSession(TapSelection{name(), "", 0, {}}, sink_), std::invalid_argument);
}

TEST_F(TapSessionTest, EndsWhenTheSinkCannotWrite) {
  connect();
  sink_.refuses = true;

  EXPECT_THROW(begin(), std::runtime_error);
}

}  // namespace
}  // namespace mpf::tools
