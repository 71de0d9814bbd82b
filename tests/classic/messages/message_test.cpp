// SPDX-License-Identifier: MIT
#include <mpf/classic/message.h>

#include <array>
#include <gtest/gtest.h>
#include <memory>

namespace mpf::test {
namespace {

constexpr std::array kTypes{messageTypeConnect,      messageTypeInt32,        messageTypeInt32Array,
                            messageTypeFloat64,      messageTypeFloat64Array, messageTypeChar8Array,
                            messageTypeSerialConfig, messageTypeOutOfBand};

TEST(ClassicMessage, AllocatesEachType) {
  for (const auto type : kTypes) {
    const std::unique_ptr<::Message> message(::Message::allocate(type));
    ASSERT_NE(message, nullptr) << type;
    EXPECT_EQ(message->getType(), type);
  }
  EXPECT_EQ(::Message::allocate(static_cast<messageType>(99)), nullptr);
}

TEST(ClassicMessage, TheNumbersOfTypesAreThoseOfNewPrograms) {
  EXPECT_EQ(messageTypeConnect, static_cast<int>(MessageType::connect));
  EXPECT_EQ(messageTypeInt32Array, static_cast<int>(MessageType::int32Array));
  EXPECT_EQ(messageTypeOutOfBand, static_cast<int>(MessageType::outOfBand));
  EXPECT_EQ(connectQueueFull, static_cast<int>(ConnectStatus::connectQueueFull));
}

TEST(ClassicMessage, AnArrayHasTheLengthThatIsSet) {
  ::Int32ArrayMessage message;
  EXPECT_EQ(message.value, nullptr);
  EXPECT_EQ(message.getLength(), 0);

  int32* const elements = message.allocValue(100);
  message.setLength(3);

  EXPECT_EQ(elements, message.value);
  EXPECT_EQ(message.value[99], 0);
  EXPECT_EQ(message.getLength(), 3);
  EXPECT_EQ(message.getMaxLength(), 100);
}

TEST(ClassicMessage, ALengthIsLimitedToTheMemory) {
  ::Char8ArrayMessage message;
  message.setSize(5);
  EXPECT_EQ(message.getSize(), 0);
  message.allocValue(10);

  message.setSize(11);
  EXPECT_EQ(message.getSize(), 10);
  message.setSize(-1);
  EXPECT_EQ(message.getSize(), 0);
}

TEST(ClassicMessage, FreeValueEndsTheElements) {
  ::Float64ArrayMessage message;
  message.allocValue(10);
  message.freeValue();

  EXPECT_EQ(message.value, nullptr);
  EXPECT_EQ(message.getMaxLength(), 0);
}

TEST(ClassicMessage, PrintChangesNothing) {
  ::Char8ArrayMessage message;
  char* const bytes = message.allocValue(2);
  message.setSize(2);
  message.value[1] = 'x';
  message.cmd = 4;

  testing::internal::CaptureStdout();
  message.print();

  EXPECT_NE(testing::internal::GetCapturedStdout().find("char8Array timeout=0 cmd=4"),
            std::string::npos);
  EXPECT_EQ(message.value, bytes);
  EXPECT_EQ(message.getSize(), 2);
  EXPECT_EQ(message.value[1], 'x');
}

}  // namespace
}  // namespace mpf::test
