// SPDX-License-Identifier: MIT
// PlainItem: what PlainRun writes, Cap'n Proto reads; what PlainFrame reads, Cap'n Proto would read
// as well.
#include "router/transport/plain_item.h"

#include <capnp/serialize.h>
#include <gmock/gmock.h>
#include <limits>
#include <string>
#include <vector>

#include <mpf/message_of.h>

#include "benchmarks/remote/bare_peer.h"
#include "schema/conversion.h"
#include "schema/router.capnp.h"
#include "tests/router/frames.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using router::PlainFrame;
using router::PlainItem;
using router::PlainRun;
using testing::ElementsAreArray;

using Words = std::vector<std::uint64_t>;  // clang cannot copy a capnp::word

Words wordsOf(kj::ArrayPtr<const kj::byte> bytes) {
  Words words(bytes.size() / sizeof(capnp::word));
  std::memcpy(words.data(), bytes.begin(), bytes.size());
  return words;
}
// The segment of a frame that has one.
Words segmentOf(const Bytes& frame) {
  return wordsOf(kj::arrayPtr(frame.data(), frame.size()).slice(sizeof(capnp::word), frame.size()));
}
kj::ArrayPtr<const capnp::word> arrayOf(const Words& words) {
  return {reinterpret_cast<const capnp::word*>(words.data()), words.size()};
}

// All that is known of an item, as text.
std::string describe(bool isRequest, bool isFirst, std::uint32_t client, std::uint32_t requestId,
                     const Message& message) {
  std::string text = isRequest ? "request " : isFirst ? "first reply " : "reply ";
  text += std::to_string(client) + '.' + std::to_string(requestId) + " type " +
          std::to_string(static_cast<int>(message.getType())) + ' ' +
          std::to_string(message.getClientType()) + ' ' + std::to_string(message.getClientExtra()) +
          ' ' + std::to_string(message.getTimeStampNs()) + " missed " +
          std::to_string(message.getMissed()) + ':';
  for (const auto byte : message.body()) text += ' ' + std::to_string(static_cast<int>(byte));
  return text;
}
std::string describe(const PlainItem& item) {
  return describe(item.isRequest, item.isFirst, item.client, item.requestId, item.message);
}

// As Cap'n Proto reads it; empty: it is neither a request without a deadline nor a reply, or its
// message cannot be read.
std::string describe(wire::Item::Reader item) {
  ConversionError error;
  if (item.isRequest() && item.getRequest().getTakeWithinNs() == 0) {
    const auto request = item.getRequest();
    const auto message = tryFromWire(request.getMessage(), {}, error);
    return message ? describe(true, false, request.getClient(), request.getRequestId(), *message)
                   : "";
  }
  if (!item.isReply()) return "";
  const auto reply = item.getReply();
  auto message = tryFromWire(reply.getMessage(), {}, error);
  if (message) message->setRoute({0, 0, Message::missedFlags(reply.getMissed()), nullptr});
  return message ? describe(false, reply.getIsFirst(), reply.getClient(), reply.getRequestId(),
                            *message)
                 : "";
}

std::vector<std::string> readByCapnProto(const Words& segment) {
  const kj::ArrayPtr<const capnp::word> only = arrayOf(segment);
  capnp::SegmentArrayMessageReader reader(kj::arrayPtr(&only, 1),
                                          {.traversalLimitInWords = UINT64_MAX});
  std::vector<std::string> texts;
  for (const auto item : reader.getRoot<wire::Frame>().getItems()) texts.push_back(describe(item));
  return texts;
}

// Empty texts for items that are not plain.
std::vector<std::string> readPlain(const Words& segment, std::size_t items) {
  std::vector<std::string> texts(items);
  const auto frame = PlainFrame::tryOpen(arrayOf(segment));
  if (!frame) return texts;
  for (std::uint32_t at = 0; at < items; ++at) {
    PlainItem item;
    if (frame->tryRead(at, item)) texts[at] = describe(item);
  }
  return texts;
}

// Expects that readItems() returns what tryRead() does.
void compareRuns(const PlainFrame& frame, std::uint32_t items) {
  MessageRun run;
  for (std::uint32_t at = 0; at < items; ++at) {
    const auto read = frame.readItems(at, items, run);
    ASSERT_LE(at + run.size(), items);
    for (std::size_t index = 0; index < run.size(); ++index) {
      PlainItem item;
      ASSERT_TRUE(frame.tryRead(at + static_cast<std::uint32_t>(index), item));
      ASSERT_EQ(describe(read[index]), describe(item));
    }
  }
}

// Returns how many items only Cap'n Proto has read.
int compareReaders(const Words& segment) {
  const kj::ArrayPtr<const capnp::word> only = arrayOf(segment);
  capnp::SegmentArrayMessageReader reader(kj::arrayPtr(&only, 1),
                                          {.traversalLimitInWords = UINT64_MAX});
  int differing = 0;
  try {
    const auto items = reader.getRoot<wire::Frame>().getItems();
    const auto plain = readPlain(segment, items.size());
    if (const auto frame = PlainFrame::tryOpen(arrayOf(segment))) compareRuns(*frame, items.size());
    for (capnp::uint at = 0; at < items.size(); ++at) {
      const auto expected = describe(items[at]);
      if (plain[at].empty() && !expected.empty()) ++differing;
      else EXPECT_EQ(plain[at], expected) << at;
    }
  } catch (const kj::Exception&) {  // NOLINT(bugprone-empty-catch): ends the connection
  }
  return differing;
}

std::vector<Message> everyPlainMessage() {
  constexpr auto kLeast = std::numeric_limits<std::int32_t>::min();
  std::vector<Message> all;
  all.push_back(Int32Message(
      {.timeout = 1, .cmd = 2, .status = kLeast, .address = -1, .extra = 5, .value = 6}));
  all.push_back(Float64Message(
      {.timeout = -7, .cmd = 8, .status = 9, .address = 10, .extra = 11, .value = -0.0}));
  all.push_back(OutOfBandMessage({.timeout = 12, .value = 13}));
  all.push_back(SerialConfigMessage(
      {.baud = 9600, .stopBits = 2, .bitsPerChar = 7, .parity = 'O', .flowControl = 'H'}));
  std::int32_t mark = kLeast;
  for (auto& message : all) {
    message.setClientType(mark++);
    message.setClientExtra(-mark);
    message.setTimeStampNs(std::int64_t{mark} << 20);
  }
  return all;
}

Words runOf(std::vector<PlainItem>& items) {
  PlainRun run;
  for (const auto& item : items) run.append(item);
  run.buildHead();
  auto words = wordsOf(run.head());
  const auto payload = wordsOf(run.payload());
  words.insert(words.end(), payload.begin(), payload.end());
  words.erase(words.begin());  // the segment table
  return words;
}

std::vector<PlainItem> everyItem() {
  std::vector<PlainItem> items;
  for (int kind = 0; kind < 3; ++kind) {
    for (auto& message : everyPlainMessage()) {
      const auto id = static_cast<std::uint32_t>(items.size());
      if (kind != 0) message.setRoute({0, 0, Message::missedFlags(id), nullptr});
      items.push_back({.isRequest = kind == 0,
                       .isFirst = kind == 1,
                       .client = UINT32_MAX - id,
                       .requestId = id + 1,
                       .message = std::move(message)});
    }
  }
  return items;
}

TEST(PlainRun, IsReadByCapnProtoAndByPlainFrame) {
  auto items = everyItem();
  std::vector<std::string> expected;
  for (const auto& item : items) expected.push_back(describe(item));

  const auto segment = runOf(items);

  EXPECT_THAT(readByCapnProto(segment), ElementsAreArray(expected));
  EXPECT_THAT(readPlain(segment, items.size()), ElementsAreArray(expected));
}

TEST(PlainRun, HasTheSegmentTableOfAFrame) {
  auto items = everyItem();
  PlainRun run;
  for (const auto& item : items) run.append(item);

  run.buildHead();

  auto words = wordsOf(run.head());
  const auto payload = wordsOf(run.payload());
  words.insert(words.end(), payload.begin(), payload.end());
  capnp::FlatArrayMessageReader reader(arrayOf(words));
  EXPECT_EQ(reader.getEnd(), arrayOf(words).end());
  EXPECT_EQ(reader.getRoot<wire::Frame>().getItems().size(), items.size());
}

TEST(PlainItem, CarriesOnlyMessagesOfFixedSize) {
  for (const auto& message : everyPlainMessage()) EXPECT_TRUE(PlainItem::canCarry(message));
  EXPECT_FALSE(PlainItem::canCarry(Message()));
  EXPECT_FALSE(PlainItem::canCarry(ConnectMessage(Connect{})));
  EXPECT_FALSE(PlainItem::canCarry(RequestFateMessage(RequestFate{})));
  EXPECT_FALSE(PlainItem::canCarry(Message::copyInline(MessageType::int32, {}))) << "unsound";
  EXPECT_FALSE(PlainItem::canCarry(
      Int32ArrayMessage::inBuffer(allocateHeapBody(Int32ArrayMessage::bytesFor(1)), 1)));
}

PlainItem int32Item(std::uint32_t id) {
  return {.isRequest = true, .client = 1, .requestId = id, .message = Int32Message({.value = 1})};
}
// `mpf bench remote` compares with frames of this length.
TEST(PlainRun, HasTheLengthOfABareFrame) {
  std::vector<PlainItem> items;
  for (const std::size_t count : {1u, 100u}) {
    while (items.size() < count) items.push_back(int32Item(1));

    const auto words = 1 + runOf(items).size();  // with the segment table

    EXPECT_EQ(words * sizeof(capnp::word), bench::bareFrameBytes(count));
  }
}

// How many of the items are read together.
std::size_t runLength(std::vector<PlainItem> items) {
  const auto segment = runOf(items);
  const auto frame = PlainFrame::tryOpen(arrayOf(segment));
  MessageRun run;
  const auto read = frame->readItems(0, static_cast<std::uint32_t>(items.size()), run);
  for (std::size_t at = 0; at < run.size(); ++at)
    EXPECT_EQ(describe(read[at]), describe(items[at])) << at;
  return run.size();
}
// The same for two items, the second one changed.
template <class Change>
std::size_t runLengthWith(const Change& change, PlainItem (*make)(std::uint32_t)) {
  std::vector<PlainItem> items;
  items.push_back(make(1));
  items.push_back(make(2));
  change(items.back());
  return runLength(std::move(items));
}

TEST(PlainItems, AreOfOneKindClientAndType) {
  EXPECT_EQ(runLengthWith([](PlainItem&) {}, int32Item), 2u);
  EXPECT_EQ(runLengthWith([](PlainItem& item) { item.client = 2; }, int32Item), 1u);
  EXPECT_EQ(runLengthWith([](PlainItem& item) { item.isRequest = false; }, int32Item), 1u);
  EXPECT_EQ(runLengthWith([](PlainItem& item) { item.message = OutOfBandMessage(); }, int32Item),
            1u);
  const auto float64 = [](std::uint32_t id) {
    auto item = int32Item(id);
    item.message = Float64Message();
    return item;
  };
  EXPECT_EQ(runLengthWith([](PlainItem&) {}, float64), 0u) << "they do not fit into a slot";
}

TEST(PlainItems, HaveRisingNumbersIfTheyAreRequestsOrFirstReplies) {
  const auto setId = [](std::uint32_t id) {
    return [id](PlainItem& item) { item.requestId = id; };
  };
  const auto first = [](std::uint32_t id) {
    auto item = int32Item(id);
    item.isRequest = false;
    item.isFirst = true;
    return item;
  };
  const auto further = [](std::uint32_t id) {
    auto item = int32Item(id);
    item.isRequest = false;
    return item;
  };
  EXPECT_EQ(runLengthWith(setId(1), int32Item), 1u);
  EXPECT_EQ(runLengthWith(setId(1), first), 1u);
  EXPECT_EQ(runLengthWith(setId(1), further), 2u);
  EXPECT_EQ(runLengthWith(setId(0), further), 1u);
  EXPECT_EQ(runLengthWith([](PlainItem& item) { item.isFirst = false; }, first), 1u);
  EXPECT_EQ(
      runLengthWith(
          [](PlainItem& item) { item.message.setRoute({0, 0, Message::missedFlags(1), nullptr}); },
          further),
      1u);
}

// Each is less than 2^31 above the one before.
TEST(PlainItems, DoNotHaveANumberTwice) {
  std::vector<PlainItem> items;
  for (const std::uint32_t id : {1u, 0x80000000u, UINT32_MAX, 1u}) items.push_back(int32Item(id));
  EXPECT_EQ(runLength(std::move(items)), 3u);
}

TEST(PlainItems, AreAtMost16) {
  std::vector<PlainItem> items;
  for (std::uint32_t id = 1; id <= 17; ++id) items.push_back(int32Item(id));
  EXPECT_EQ(runLength(std::move(items)), 16u);
}

// A frame that Cap'n Proto has built, with items of all kinds.
TEST(PlainFrame, ReadsThePlainItemsOfAMixedFrame) {
  const auto message = [](wire::Envelope::Builder envelope) {
    envelope.setClientType(4);
    envelope.initInt32().setValue(7);
  };
  const auto segment = segmentOf(
      frameOf({[&](wire::Item::Builder item) {
                 auto request = item.initRequest();
                 request.setClient(1);
                 request.setRequestId(2);
                 message(request.initMessage());
               },
               ping(5),
               [&](wire::Item::Builder item) {
                 auto request = item.initRequest();
                 request.setTakeWithinNs(1);  // a deadline
                 message(request.initMessage());
               },
               [&](wire::Item::Builder item) { item.initRequest().initMessage().initInt32Array(); },
               [&](wire::Item::Builder item) { item.initReply(); },  // without a message
               [&](wire::Item::Builder item) {
                 auto reply = item.initReply();
                 reply.setClient(3);
                 reply.setIsFirst(true);
                 message(reply.initMessage());
               }}));

  const auto plain = readPlain(segment, 6);
  const auto all = readByCapnProto(segment);

  for (const std::size_t at : {0u, 5u}) EXPECT_EQ(plain[at], all[at]);
  EXPECT_THAT(plain[0], testing::StartsWith("request 1.2 type 2 4"));
  for (const std::size_t at : {1u, 2u, 3u, 4u}) EXPECT_EQ(plain[at], "") << at;
}

// Whatever the bytes are: what is read is what Cap'n Proto reads, and nothing outside is read (see
// make test-asan).
TEST(PlainFrame, ReadsOnlyWhatCapnProtoReads) {
  Random random;
  auto items = everyItem();
  const auto honest = runOf(items);
  int differing = 0;
  for (int round = 0; round < 20'000 && !testing::Test::HasFailure(); ++round) {
    auto segment = honest;
    for (auto changes = random.below(4) + 1; changes != 0; --changes) {
      auto* const bytes = reinterpret_cast<unsigned char*>(segment.data());
      bytes[random.below(segment.size() * sizeof(capnp::word))] ^=
          static_cast<unsigned char>(1u << random.below(8));
    }
    if (random.below(4) == 0) segment.resize(random.below(segment.size()) + 1);
    differing += compareReaders(segment);
  }
  EXPECT_GT(differing, 0) << "some were left to Cap'n Proto";
}

}  // namespace
}  // namespace mpf::test
