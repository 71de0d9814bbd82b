// SPDX-License-Identifier: MIT
// A Line and a peer of another minor version: unknown fields and items are ignored, and missing
// fields have their default values.
#include "tests/router/newer_router.capnp.h"
#include "tests/router/transport/line_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// A frame of a newer peer, with the fields that are new.
Bytes newerFrame(const std::vector<std::function<void(newer::Item::Builder)>>& items) {
  capnp::MallocMessageBuilder message;
  auto frame = message.initRoot<newer::Frame>();
  frame.setSentAtNs(~std::uint64_t{0});
  auto list = frame.initItems(static_cast<capnp::uint>(items.size()));
  for (capnp::uint at = 0; at < list.size(); ++at) {
    list[at].setUrgency(1e300);
    items[at](list[at]);
  }
  return bytesOf(message);
}

template <class Greeting>
void fillGreeting(Greeting greeting) {
  greeting.setProtocolMajor(1);
  greeting.setRouter("another");
  greeting.setMaxFrameBytes(1u << 20);
  greeting.setMaxMessageBytes(1u << 19);
}

void newerGreeting(newer::Item::Builder item) {
  auto greeting = item.initGreeting();
  fillGreeting(greeting);
  greeting.setProtocolMinor(1);
  greeting.setMaxClients(77);
  greeting.initFeatures(2).set(0, "everything");
  greeting.setTimeZone(-11);
}

class NewerPeerTest : public LineTest {
 protected:
  void SetUp() override {
    start();
    receive();
    send(newerFrame({newerGreeting}));
    receive();
    ASSERT_THAT(said_, ElementsAre("greeted"));
    said_.clear();
  }
};

TEST_F(NewerPeerTest, IsGreeted) {
  EXPECT_EQ(line_->peer().router, "another");
  EXPECT_EQ(line_->peer().maxFrameBytes, 1u << 20);
  EXPECT_EQ(line_->peer().maxClients, 77u);
}

// They are handed on in their order.
TEST_F(NewerPeerTest, ItemsOfUnknownKindsDoNotEndTheLine) {
  int unknown = 0;
  onItem_ = [&](wire::Item::Reader item) {
    unknown += static_cast<int>(item.which()) > static_cast<int>(wire::Item::CREDIT) ? 1 : 0;
  };

  beginToSend(newerFrame({[](auto item) { item.setWeather("rain"); },
                          [](auto item) { item.setClose(3); }, [](auto item) { item.setMoon(2); },
                          [](auto item) { item.initPing().setStamp(4); }}));

  EXPECT_THAT(receive(), ElementsAre("(pong = (stamp = 4))"));
  EXPECT_EQ(unknown, 2);
  EXPECT_EQ(said_.size(), 3u);
}

TEST_F(NewerPeerTest, FieldsThatAreNewAreIgnored) {
  send(newerFrame({[](auto item) {
    auto reply = item.initReply();
    reply.setClient(5);
    reply.setRequestId(6);
    reply.setTookNs(1);
    auto message = reply.initMessage();
    message.setClientType(8);
    message.setTrace(9);
    auto int32 = message.initInt32();
    int32.setValue(10);
    int32.setUnit("mm");
  }}));

  EXPECT_THAT(said_, ElementsAre(AllOf(HasSubstr("client = 5, requestId = 6"),
                                       HasSubstr("clientType = 8"), HasSubstr("value = 10"))));
}

TEST_F(NewerPeerTest, AMessageOfAnUnknownTypeIsReportedAsSuch) {
  ConversionError error;
  onItem_ = [&](wire::Item::Reader item) {
    EXPECT_FALSE(tryFromWire(item.getRequest().getMessage(), {}, error));
  };

  send(newerFrame({[](auto item) {
    auto message = item.initRequest().initMessage();
    message.initColour().setRed(0.5);
  }}));

  EXPECT_EQ(error.fault, ConversionFault::unknownType);
  EXPECT_EQ(end_, "");
}

// Its greeting is shorter than ours; a missing field is 0, which means "not specified".
TEST_F(LineTest, AnOlderPeerIsGreeted) {
  start();
  receive();
  capnp::MallocMessageBuilder message;
  fillGreeting(message.initRoot<newer::OlderFrame>().initItems(1)[0].initGreeting());

  send(bytesOf(message));

  EXPECT_THAT(said_, ElementsAre("greeted"));
  EXPECT_EQ(line_->peer().maxFrameBytes, 1u << 20);
  EXPECT_EQ(line_->peer().maxClients, 0u);
}

}  // namespace
}  // namespace mpf::test
