// SPDX-License-Identifier: MIT
// MessageServer: arguments that it refuses. The tests of clients show how it serves them.
#include <mpf/message_server.h>

#include <functional>
#include <gtest/gtest.h>
#include <span>
#include <stdexcept>

#include "tests/support/test_backplane.h"

namespace mpf::test {
namespace {

TEST(MessageServerTest, AReplyWithMoreElementsThanALengthCanCountIsAnError) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");

  for (const std::size_t n : {std::size_t{1} << 32, std::size_t{1} << 61, SIZE_MAX}) {
    EXPECT_THROW(static_cast<void>(server.allocReplyMessage<Float64Array>(Message(), n)),
                 std::length_error);
  }
}

TEST(MessageServerTest, AnInvalidNameOrQueueSizeIsAnError) {
  const TestBackplane backplane;

  EXPECT_THROW(MessageServer(backplane, ""), std::invalid_argument);
  EXPECT_THROW(MessageServer(backplane, "server", {.queueSize = 0}), std::invalid_argument);
}

TEST(MessageServerTest, InvalidRightsAreAnError) {
  const TestBackplane backplane;

  EXPECT_THROW(MessageServer(backplane, "server", {.rights = {.mode = 0}}), std::invalid_argument);
}

TEST(MessageServerTest, AnEmptyHandlerIsAnError) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");

  EXPECT_THROW(server.on<Int32>(std::function<void(Int32&)>()), std::invalid_argument);
  EXPECT_THROW(server.on<Int32>(std::function<void(std::span<Int32>)>()), std::invalid_argument);
  EXPECT_THROW(server.on<Int32Array>(static_cast<void (*)(Int32ArrayMessage&)>(nullptr)),
               std::invalid_argument);
}

TEST(MessageServerTest, AReplyWithoutARequestIsNotSent) {
  const TestBackplane backplane;
  MessageServer server(backplane, "server");
  auto reply = server.allocReplyMessage<Int32>(Message());

  EXPECT_EQ(server.reply(std::move(reply)), ReplyResult::clientGone);
}

}  // namespace
}  // namespace mpf::test
