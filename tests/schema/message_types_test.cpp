// SPDX-License-Identifier: MIT
#include <capnp/schema.h>
#include <gmock/gmock.h>
#include <string>

#include "schema/message.capnp.h"
#include "schema/visit.h"

namespace {

using namespace mpf;

std::string name(kj::StringPtr text) { return text.cStr(); }

template <class Each>
void forEachType(Each&& each) {
  [&]<class... T>(std::type_identity<std::tuple<T...>>) {
    (each.template operator()<T>(), ...);
  }(std::type_identity<MessageTypes>{});
}

template <class T>
std::vector<std::string> describedFields() {
  std::vector<std::string> names;
  std::apply([&](const auto&... field) { (names.emplace_back(field.name), ...); }, T::fields());
  if constexpr (ArrayBody<T>) names.emplace_back(kValueName);
  return names;
}

// The union of Envelope has exactly the types of MessageTypes, in the order of their numbers.
TEST(MessageTypes, HaveTheOrderOfTheEnvelope) {
  const auto members = capnp::Schema::from<wire::Envelope>().getUnionFields();

  ASSERT_EQ(members.size(), std::tuple_size_v<MessageTypes>);
  forEachType([&]<class T>() {
    const auto member = members[static_cast<unsigned>(T::kType) - 1];
    EXPECT_EQ(name(member.getProto().getName()), T::kName);
    EXPECT_EQ(member.getProto().getDiscriminantValue() + 1, static_cast<int>(T::kType)) << T::kName;
  });
}

TEST(MessageTypes, HaveTheFieldsOfTheirCapnpStructs) {
  forEachType([&]<class T>() {
    const auto schema = capnp::Schema::from<wire::Envelope>()
                            .getFieldByName(std::string(T::kName).c_str())
                            .getType()
                            .asStruct();
    std::vector<std::string> inSchema;
    for (const auto field : schema.getFields())
      inSchema.push_back(name(field.getProto().getName()));

    EXPECT_THAT(describedFields<T>(), testing::UnorderedElementsAreArray(inSchema)) << T::kName;
  });
}

template <class Names>
void expectSameEnum(capnp::EnumSchema schema, const Names& names) {
  const auto enumerants = schema.getEnumerants();
  ASSERT_EQ(enumerants.size(), names.size());
  for (unsigned i = 0; i < names.size(); ++i)
    EXPECT_EQ(name(enumerants[i].getProto().getName()), names[i]);
}

TEST(MessageTypes, NameStatusesAndFatesAsTheSchemaDoes) {
  expectSameEnum(capnp::Schema::from<wire::ConnectStatus>(), kConnectStatusNames);
  expectSameEnum(capnp::Schema::from<wire::Fate>(), kFateNames);
}

TEST(MessageTypes, HaveNames) {
  EXPECT_EQ(toString(MessageType::int32Array), "int32Array");
  EXPECT_EQ(toString(MessageType::none), "none");
  EXPECT_EQ(toString(MessageType{77}), "unknown");
  EXPECT_EQ(toString(ConnectStatus::connectQueueFull), "connectQueueFull");
  EXPECT_EQ(toString(ConnectStatus{-1}), "unknown");
  EXPECT_EQ(toString(Fate::outcomeUnknown), "outcomeUnknown");
  EXPECT_EQ(toString(Fate{5}), "unknown");
}

TEST(MessageTypes, ClampTheEndOfMessageStringToItsRoom) {
  Char8Array message{.eomLen = 2, .eomString = {'\r', '\n', 'x', 'y'}};
  EXPECT_EQ(message.eom(), "\r\n");

  message.eomLen = 1000;
  EXPECT_EQ(message.eom(), "\r\nxy");

  message.eomLen = -1;
  EXPECT_EQ(message.eom(), "");
}

}  // namespace
