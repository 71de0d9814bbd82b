// SPDX-License-Identifier: MIT
// PeerGreeting: what is read from a greeting, and which greetings are refused.
#include "router/transport/peer_greeting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "router/protocol_error.h"
#include "tests/router/frames.h"

namespace mpf::router::test {
namespace {

using testing::HasSubstr;

PeerGreeting read(const std::function<void(wire::Greeting::Builder)>& change) {
  capnp::MallocMessageBuilder message;
  auto item = message.initRoot<wire::Item>();
  mpf::test::greeting(change)(item);
  return PeerGreeting::read(item.asReader().getGreeting());
}

TEST(PeerGreeting, HasNotArrivedAtFirst) {
  EXPECT_FALSE(PeerGreeting().hasArrived());
  EXPECT_EQ(PeerGreeting().maxMessageBytesWith(Limits{}), 0u);
}

TEST(PeerGreeting, IsReadAndItsTextsAreEscaped) {
  const auto greeting = read([](auto fields) {
    fields.setRouter("ioc\n1");
    fields.setProgram("mpf-router 9");
    fields.setMaxClients(5);
  });

  EXPECT_TRUE(greeting.hasArrived());
  EXPECT_EQ(greeting.router, "ioc\\n1");
  EXPECT_EQ(greeting.program, "mpf-router 9");
  EXPECT_EQ(greeting.maxClients, 5u);
}

TEST(PeerGreeting, OfAnotherMajorVersionIsRefused) {
  try {
    static_cast<void>(read([](auto fields) { fields.setProtocolMajor(2); }));
    FAIL();
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.code(), FarewellCode::VERSION);
    EXPECT_THAT(error.what(), HasSubstr("protocol 2."));
  }
}

TEST(PeerGreeting, WithShortFramesIsRefused) {
  EXPECT_THROW(
      static_cast<void>(read([](auto fields) { fields.setMaxFrameBytes(kLeastFrameBytes - 1); })),
      ProtocolError);
  EXPECT_NO_THROW(
      static_cast<void>(read([](auto fields) { fields.setMaxFrameBytes(kLeastFrameBytes); })));
}

// The smallest of both limits and of what fits into a frame of the peer.
TEST(PeerGreeting, LimitsTheSizeOfMessages) {
  Limits limits;
  limits.maxMessageBytes = 1000;
  const auto greeting = read([](auto fields) {
    fields.setMaxMessageBytes(2000);
    fields.setMaxFrameBytes(kLeastFrameBytes);
  });

  EXPECT_EQ(greeting.maxMessageBytesWith(limits), 1000u);
  limits.maxMessageBytes = 3000;
  EXPECT_EQ(greeting.maxMessageBytesWith(limits), 2000u);
  const auto large = read([](auto fields) { fields.setMaxFrameBytes(kLeastFrameBytes); });
  limits.maxMessageBytes = 1u << 20;
  EXPECT_LT(large.maxMessageBytesWith(limits), kLeastFrameBytes);
}

// A peer of the same limits accepts what this router sends.
TEST(FillLimits, IsAGreetingThatCanBeRead) {
  Limits limits;
  limits.maxMessageBytes = 1u << 22;

  const auto greeting = read([&](auto fields) { fillLimits(fields, limits); });

  EXPECT_EQ(greeting.maxMessageBytesWith(limits), 1u << 22);
  EXPECT_GT(greeting.maxFrameBytes, 1u << 22);
}

}  // namespace
}  // namespace mpf::router::test
