// SPDX-License-Identifier: MIT
// ServerWatch: servers of this process that are bindable, stalled, busy or dead.
#include "crate/supervisor/server_watch.h"

#include <unistd.h>

#include <gmock/gmock.h>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::crate::test {
namespace {

using mpf::test::Program;
using testing::ElementsAre;
using testing::IsEmpty;

// A server of this process, which accepts clients and takes requests only when the test says so.
class ServerWatchTest : public testing::Test {
 protected:
  void connect() {
    client_.bind("one");
    accept();
  }
  void accept() {
    while (!client_.isConnected()) {
      EXPECT_FALSE(server_.receive());
      dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(1)));
    }
  }
  void send() { ASSERT_EQ(client_.send(Int32Message()), SendResult::sent); }
  bool isStalled() {
    watch_.look();
    watch_.look();
    return watch_.isStalled(::getpid());
  }

  const mpf::test::Watchdog watchdog_{"ServerWatch"};
  mpf::test::TestBackplane backplane_;
  ServerWatch watch_{backplane_.name()};
  MessageServer server_{backplane_, "one"};
  Dispatcher dispatcher_{backplane_};
  MessageClient client_{dispatcher_, [](Message&&) {}};
};

TEST_F(ServerWatchTest, SeesTheServersOfAProcess) {
  EXPECT_THAT(watch_.notServing(::getpid(), 0, {"one"}), ElementsAre("one")) << "before a look";

  watch_.look();

  EXPECT_THAT(watch_.notServing(::getpid(), 0, {"one"}), IsEmpty());
  EXPECT_THAT(watch_.notServing(::getpid(), 0, {}), IsEmpty());
  EXPECT_THAT(watch_.notServing(::getpid(), 0, {"one", "two"}), ElementsAre("two"));
  EXPECT_THAT(watch_.notServing(::getpid(), 1, {"one"}), ElementsAre("one"));
  EXPECT_THAT(watch_.notServing(::getppid(), 0, {"one"}), ElementsAre("one"));
}

TEST_F(ServerWatchTest, AnIdleServerIsNotStalled) {
  EXPECT_FALSE(isStalled());
  connect();
  EXPECT_FALSE(isStalled());
}

TEST_F(ServerWatchTest, AServerThatTakesNoMessageIsStalled) {
  connect();
  send();
  EXPECT_TRUE(isStalled());

  EXPECT_TRUE(server_.receive());

  EXPECT_FALSE(isStalled());
}

TEST_F(ServerWatchTest, AServerThatAcceptsNoClientIsStalled) {
  client_.bind("one");
  dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(1)));

  EXPECT_TRUE(isStalled());

  accept();
  EXPECT_FALSE(isStalled());
}

TEST_F(ServerWatchTest, AServerThatTakesMessagesBetweenTheLooksIsNotStalled) {
  connect();
  send();
  send();
  watch_.look();
  EXPECT_TRUE(server_.receive());

  watch_.look();

  EXPECT_FALSE(watch_.isStalled(::getpid()));
}

TEST_F(ServerWatchTest, AServerThatWorksOnOneRequestIsBusyWithIt) {
  connect();
  send();
  auto request = server_.receive();
  ASSERT_TRUE(request);
  watch_.look();
  EXPECT_FALSE(watch_.workOf(::getpid())) << "seen once";

  watch_.look();

  const auto work = watch_.workOf(::getpid());
  ASSERT_TRUE(work);
  EXPECT_EQ(work->server, "one");
  EXPECT_EQ(work->handling.type, static_cast<std::uint16_t>(MessageType::int32));
  EXPECT_GT(work->forNs, 0);
  EXPECT_FALSE(watch_.workOf(::getppid()));
}

TEST_F(ServerWatchTest, TheNextRequestIsOtherWork) {
  connect();
  send();
  send();
  auto request = server_.receive();
  watch_.look();
  watch_.look();
  ASSERT_TRUE(watch_.workOf(::getpid()));
  EXPECT_EQ(server_.reply(std::move(request)), ReplyResult::sent);
  request = server_.receive();
  ASSERT_TRUE(request);

  watch_.look();

  EXPECT_FALSE(watch_.workOf(::getpid()));
}

TEST_F(ServerWatchTest, RemovesTheFilesOfDeadProcesses) {
  Program program({MPF_TEST_INT32_SERVER, "--backplane", backplane_.name()});
  ASSERT_NE(program.waitForLine("serving"), "");
  const auto files = backplane_.segmentNames().size();
  program.end(SIGKILL);

  watch_.removeFilesOfDead();

  EXPECT_LT(backplane_.segmentNames().size(), files);
  watch_.look();
  EXPECT_THAT(watch_.notServing(::getpid(), 0, {"one"}), IsEmpty())
      << "of those that live, nothing is removed";
}

}  // namespace
}  // namespace mpf::crate::test
