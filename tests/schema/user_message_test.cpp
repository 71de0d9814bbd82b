// SPDX-License-Identifier: MIT
#include <mpf/user_message.h>

#include <capnp/any.h>
#include <capnp/message.h>
#include <gmock/gmock.h>
#include <kj/exception.h>

#include "schema/message.capnp.h"

namespace {

using namespace mpf;
using Struct = wire::Int32Array;  // in place of a user's own struct

TEST(User, IsBuiltAndReadInPlace) {
  UserBuilder builder(UserMessage::allocValue(4096));
  auto fields = builder.initRoot<Struct>();
  fields.setAddress(3);
  fields.initValue(10).set(9, 7);

  const auto message = std::move(builder).finish();
  UserReader reader(message);

  EXPECT_EQ(message.getSize() % 8, 0U);
  EXPECT_LT(message.getSize(), 200U);
  EXPECT_EQ(reader.getRoot<Struct>().getAddress(), 3);
  EXPECT_EQ(reader.getRoot<Struct>().getValue()[9], 7);
  const auto root = capnp::AnyStruct::Reader(reader.getRoot<capnp::AnyStruct>()).getDataSection();
  EXPECT_GT(reinterpret_cast<const std::byte*>(root.begin()), message.body().data());
  EXPECT_LE(reinterpret_cast<const std::byte*>(root.end()),
            message.body().data() + message.body().size());
}

TEST(User, RefusesAStructThatDoesNotFit) {
  UserBuilder builder(UserMessage::allocValue(64));
  auto fields = builder.initRoot<Struct>();

  EXPECT_THROW(fields.initValue(1000), kj::Exception);
  EXPECT_THROW(UserBuilder(UserMessage::allocValue(8)), kj::Exception);
  EXPECT_THROW(static_cast<void>(std::move(UserBuilder(UserMessage::allocValue(64))).finish()),
               kj::Exception);
}

TEST(User, IsCopiedFromAnyBuilder) {
  capnp::MallocMessageBuilder builder(8,
                                      capnp::AllocationStrategy::FIXED_SIZE);  // several segments
  builder.initRoot<Struct>().initValue(100).set(99, 5);

  const auto message = toUserMessage(builder);

  EXPECT_EQ(UserReader(message).getRoot<Struct>().getValue()[99], 5);
}

TEST(User, RefusesBytesThatAreNotACapnProtoMessage) {
  auto message = UserMessage::allocValue(16);
  std::memset(message.value().data(), 0xff, message.getSize());

  EXPECT_THROW(UserReader reader(message), kj::Exception);
}

}  // namespace
