// SPDX-License-Identifier: MIT
// The samples of examples/classic as processes: with each other, and with programs of the new API.
#include <gtest/gtest.h>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ClassicSamplesTest : public testing::Test {
 protected:
  ClassicSamplesTest() { ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1); }
  Watchdog watchdog_{"samples of the original API"};
  TestBackplane backplane_;
};

std::string client(const std::string& server, int number) {
  return runCommand(std::string(MPF_TEST_CLASSIC_CLIENTINT32) + ' ' + server + ' ' +
                    std::to_string(number))
      .output;
}

TEST_F(ClassicSamplesTest, ClientAndServerExchangeMessages) {
  const Program server({MPF_TEST_CLASSIC_SERVERINT32, "echo"});

  EXPECT_EQ(client("echo", 3), "reply 1 status 0\nreply 2 status 0\nreply 3 status 0\n");
}

TEST_F(ClassicSamplesTest, TheClientWorksWithAServerOfTheNewApi) {
  const Program server({MPF_TEST_INT32_SERVER, "echo"});

  EXPECT_EQ(client("echo", 2), "reply 1 status 0\nreply 2 status 0\n");
}

TEST_F(ClassicSamplesTest, TheClientSeesThatAServerRefuses) {
  MessageServer server(backplane_, "refuser");
  const std::jthread serving([&server](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      server.waitForMessage(Deadline::after(10ms));
      while (server.receive()) {
      }
    }
  });

  EXPECT_EQ(client("refuser", 1), "reply 1 status -1\n");
}

TEST_F(ClassicSamplesTest, TheServerSendsAdditionalMessagesAndRefusesOtherTypes) {
  const Program server({MPF_TEST_CLASSIC_SERVERINT32, "echo"});
  SyncClient client(backplane_, "echo");

  auto first = client.call(Int32Message({.cmd = 1, .value = 5}), 600s);
  const auto second = client.receive(600s);

  EXPECT_EQ((*first.as<Int32>())->value, -5);
  EXPECT_EQ(second.tryAs<Int32>()->value, 5);
  EXPECT_EQ(client.call(Float64Message(), 600s).fate(), Fate::refused);
}

}  // namespace
}  // namespace mpf::test
