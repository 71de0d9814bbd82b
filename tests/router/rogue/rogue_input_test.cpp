// SPDX-License-Identifier: MIT
// Invalid input, to a router that accepts and to one that connects. The router closes the
// connection; its memory, files and segments do not grow, and its honest clients are not affected.
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tests/router/rogue/rogue_client.h"
#include "tests/router/rogue/rogue_server.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::size_t kWord = 8;

void append32(Bytes& bytes, std::uint64_t value) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

// The beginning of a frame of `segments` segments of `words` words each.
Bytes segmentTable(std::uint32_t segments, std::uint64_t words) {
  Bytes table;
  append32(table, segments - 1);
  for (std::uint32_t segment = 0; segment < segments; ++segment) append32(table, words);
  table.resize((table.size() + kWord - 1) / kWord * kWord);
  return table;
}

// A message of an unknown type, with lists that are nested `depth` deep.
Bytes nestedFrame(const std::function<Fill(const FillMessage&)>& carry, std::uint32_t depth) {
  // The last word is the pointer of User; its discriminant is four words before that.
  auto bytes = frameOf({carry([](auto message) { message.initUser(); })});
  bytes[bytes.size() - 4 * kWord] = 99;
  std::uint32_t words = 0;
  std::memcpy(&words, &bytes[4], sizeof words);
  words += depth;
  std::memcpy(&bytes[4], &words, sizeof words);
  const Bytes listOfOnePointer{0x01, 0, 0, 0, 0x0e, 0, 0, 0};  // the next word
  bytes.resize(bytes.size() - kWord);
  for (std::uint32_t level = 0; level < depth; ++level)
    bytes.insert(bytes.end(), listOfOnePointer.begin(), listOfOnePointer.end());
  bytes.resize(bytes.size() + kWord);  // a null pointer
  return bytes;
}

// `Fixture`: RogueClientTest, whose router accepts, or RogueServerTest, whose router connects.
template <class Fixture>
class RogueInputTest : public Fixture {
 protected:
  using Fixture::Fixture;

  // Measures the router after it has served a rogue that follows the protocol.
  void SetUp() override {
    Fixture::SetUp();
    this->rogue().close();
    before_ = this->usage();
    // A router that connects may or may not be connecting at this moment.
    if (std::is_same_v<Fixture, RogueServerTest>) ++before_->files;
  }
  void TearDown() override {
    if (before_) this->expectUsage(*before_, kSlackKb);  // absent: SetUp() failed
    Fixture::TearDown();
  }
  [[nodiscard]] RoguePeer greeted() {
    auto peer = this->stranger();
    peer.sendItems({greeting()});
    return peer;
  }
  void expectCut(RoguePeer peer, const Bytes& input,
                 const testing::Matcher<const std::string&>& farewell) {
    EXPECT_TRUE(peer.send(input));
    EXPECT_THAT(peer.farewell(), farewell);
    peer.close();
    this->expectHonestWork();
  }

 private:
  static constexpr std::size_t kSlackKb = 24 << 10;
  std::optional<Usage> before_;
};

struct Roles {
  template <class Fixture>
  static std::string GetName(int) {  // NOLINT(readability-identifier-naming): GoogleTest's name
    return std::is_same_v<Fixture, RogueClientTest> ? "RouterThatAccepts" : "RouterThatConnects";
  }
};
using BothRoles = testing::Types<RogueClientTest, RogueServerTest>;
TYPED_TEST_SUITE(RogueInputTest, BothRoles, Roles);

TYPED_TEST(RogueInputTest, MalformedIsCut) {
  const std::string http = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  auto astray = frameOf({ping(1)});
  astray[2 * kWord] ^= 0x80;  // the pointer to the list of items
  auto emptyRoot = segmentTable(1, 1);
  emptyRoot.resize(emptyRoot.size() + kWord, 0xff);

  this->expectCut(this->stranger(), Bytes(http.begin(), http.end()), HasSubstr("segments"));
  for (const auto& input :
       {Bytes(kWord, 0xff), Bytes(kWord), segmentTable(513, 1), emptyRoot, astray}) {
    this->expectCut(this->greeted(), input, HasSubstr("code = protocol"));
  }
}

// The router reads the data behind the invalid frame; otherwise the connection would be reset
// before the rogue reads the farewell.
TYPED_TEST(RogueInputTest, AFarewellArrivesAlthoughMoreDataFollows) {
  auto input = segmentTable(513, 1);
  input.resize(input.size() + (std::size_t{1} << 20));

  this->expectCut(this->greeted(), input, HasSubstr("code = protocol"));
}

TYPED_TEST(RogueInputTest, TruncatedIsCut) {
  constexpr std::size_t kStep = 7;
  const auto frames = joined({frameOf({greeting()}), frameOf({ping(1)})});

  for (std::size_t length = 0; length < frames.size(); length += kStep) {
    auto peer = this->stranger();
    peer.send(std::span(frames).first(length));
    peer.sendNoMore();
    EXPECT_EQ(peer.farewell(), "none") << "after " << length << " bytes";
  }
}

TYPED_TEST(RogueInputTest, OversizedIsCut) {
  constexpr std::uint64_t kMost = UINT32_MAX;
  auto peer = this->greeted();
  const auto limit = peer.next(wire::Item::GREETING).getGreeting().getMaxFrameBytes();
  peer.close();
  const auto tooLong =
      AllOf(HasSubstr("code = limit"), HasSubstr("bytes; the limit is " + std::to_string(limit)));

  this->expectCut(this->greeted(), segmentTable(1, limit / kWord), tooLong);  // plus the table
  this->expectCut(this->greeted(), segmentTable(1, kMost), tooLong);
  this->expectCut(this->greeted(), segmentTable(512, kMost), tooLong);
  this->expectCut(this->stranger(), segmentTable(1, (64 << 10) / kWord),
                  AllOf(HasSubstr("code = limit"), HasSubstr("65536")));
}

// A frame of the largest permitted size, of which only a few bytes arrive.
TYPED_TEST(RogueInputTest, AnAnnouncedFrameNeedsNoMemory) {
  constexpr std::size_t kLittleKb = 1024;
  auto peer = this->greeted();
  const auto limit = peer.next(wire::Item::GREETING).getGreeting().getMaxFrameBytes();
  const auto before = this->usage();

  peer.send(joined({frameOf({ping(1)}), segmentTable(1, limit / kWord - 1), Bytes(100)}));
  while (peer.next(wire::Item::PONG).getPong().getStamp() != 1) {
  }

  this->expectUsage(before, kLittleKb);
}

TYPED_TEST(RogueInputTest, DeeplyNestedIsCut) {
  for (const std::uint32_t depth : {20u, 1000u, 100'000u}) {
    auto peer = this->rogue();
    const auto carry = [&](const FillMessage& fill) { return this->message(peer, fill); };
    const auto input = nestedFrame(carry, depth);
    this->expectCut(std::move(peer), input,
                    AllOf(HasSubstr("code = protocol"), HasSubstr("nested")));
  }
}

// A router that soon takes a silent peer for dead.
template <class Fixture>
class RogueSilenceTest : public RogueInputTest<Fixture> {
 protected:
  RogueSilenceTest() : RogueInputTest<Fixture>("5s") {}
};
TYPED_TEST_SUITE(RogueSilenceTest, BothRoles, Roles);

// A few bytes at a time, and never a whole frame.
TYPED_TEST(RogueSilenceTest, SlowDripIsCut) {
  const auto frame = frameOf(std::vector<Fill>(1000, ping(1)));
  EXPECT_THAT(this->stranger().drip(frame), HasSubstr("code = silence"));
  EXPECT_THAT(this->greeted().drip(frame), HasSubstr("code = silence"));
  this->expectHonestWork();
}

TYPED_TEST(RogueSilenceTest, SilenceIsCut) {
  EXPECT_THAT(this->stranger().farewell(), HasSubstr("code = silence"));
  EXPECT_THAT(this->greeted().farewell(), HasSubstr("code = silence"));
  this->expectHonestWork();
}

TYPED_TEST(RogueSilenceTest, ReadingNothingIsCut) {
  auto peer = this->greeted();
  const auto pings = frameOf(std::vector<Fill>(10'000, ping(1)));

  while (peer.send(pings)) {
  }

  this->expectHonestWork();
}

}  // namespace
}  // namespace mpf::test
