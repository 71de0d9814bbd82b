// SPDX-License-Identifier: MIT
#include "server/programs/hardware/other_types.h"

#include <thread>
#include <vector>

#include "tests/server/programs/hardware/hardware_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

// As for a serial server: it handles two types, one of them SerialConfig.
TEST_F(HardwareTest, RepliesToAllTypesExceptTheHandledOnes) {
  MessageServer server(backplane_, "server");
  std::vector<MessageType> noted;
  server.on<Char8Array>([](Char8Array& request) { request.status = 5; });
  server.on<SerialConfig>([](SerialConfig& request) { request.baud = 19200; });
  answerOtherTypes<Char8Array, SerialConfig>(server,
                                             [&](MessageType type) { noted.push_back(type); });
  std::thread thread([&] { server.run(); });
  SyncClient client(backplane_, "server");

  auto bytes = client.call(Char8ArrayMessage::allocValue(1), 60s);
  auto config = client.call(SerialConfigMessage(), 60s);
  auto other = client.call(Int32Message({.value = 3}), 60s);
  server.interrupt();
  thread.join();

  EXPECT_EQ(bytes.message().tryAs<Char8Array>()->status, 5);
  EXPECT_EQ(config.message().tryAs<SerialConfig>()->baud, 19200);
  EXPECT_EQ(other.message().tryAs<Int32>()->status, -1);
  EXPECT_EQ(other.message().tryAs<Int32>()->value, 3);
  EXPECT_THAT(noted, ElementsAre(MessageType::int32));
}

}  // namespace
}  // namespace mpf::test
