// SPDX-License-Identifier: MIT
#include "client/connector.h"

#include <fstream>
#include <gtest/gtest.h>
#include <stdexcept>

#include <mpf/message_server.h>

#include "shm/segment_name.h"
#include "tests/client/binding_parts_fixture.h"
#include "tests/shm/dead_server.h"

namespace mpf::test {
namespace {

class ConnectorTest : public BindingPartsTest {
 protected:
  [[nodiscard]] bool hasPendingBind() const {
    for (const auto& name : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(name);
      if (parsed && parsed->kind == NameKind::pendingBind) return true;
    }
    return false;
  }
  [[nodiscard]] std::string serverWindow() const {
    return SegmentName::serverWindow(backplane_.name(), 0, "dac");
  }
  // How often this process has mapped the server's window.
  [[nodiscard]] int mappings() const {
    std::ifstream maps("/proc/self/maps");
    int found = 0;
    for (std::string line; std::getline(maps, line);)
      found += line.find(serverWindow()) != std::string::npos ? 1 : 0;
    return found;
  }
};

TEST_F(ConnectorTest, HasNoServerAtFirst) {
  EXPECT_EQ(connector_.notConnectedBecause(), "not bound to a server yet");
  EXPECT_FALSE(connector_.wait(Deadline::atNs(0), [] { return false; }));
}

TEST_F(ConnectorTest, RefusesASecondServer) {
  connector_.setServer("dac", 3);

  EXPECT_THROW(connector_.setServer("dac", 3), std::logic_error);
  EXPECT_EQ(connector_.server(), "dac");
  EXPECT_EQ(connector_.location(), 3);
}

TEST_F(ConnectorTest, RefusesAnInvalidName) {
  EXPECT_THROW(connector_.setServer("", 0), std::invalid_argument);

  connector_.setServer("dac", 0);  // no server is set yet
}

TEST_F(ConnectorTest, PublishesTheNameOfAMissingServer) {
  connector_.setServer("dac", 0);

  EXPECT_FALSE(connector_.tryFindServer());

  EXPECT_EQ(connector_.notConnectedBecause(), "server \"dac\" at location 0 is not running");
  EXPECT_TRUE(hasPendingBind());
  connector_.cancelPendingBind();
  EXPECT_FALSE(hasPendingBind());
}

TEST_F(ConnectorTest, OpensALinkThatTheServerAccepts) {
  MessageServer server(backplane_, "dac");
  connector_.setServer("dac", 0);
  const auto window = connector_.tryFindServer();
  ASSERT_TRUE(window);

  ASSERT_TRUE(connector_.tryOpenLink(window, sender_));
  connector_.askForAcceptance(sender_.channel()->link(), *owner_);

  while (sender_.channel()->link().peerState() != layout::LinkState::open)
    static_cast<void>(server.receive());
  EXPECT_EQ(connector_.incarnation(), window->header().incarnation);
  connector_.closeLink(sender_);
  EXPECT_FALSE(sender_.channel());
}

TEST_F(ConnectorTest, UnmapsTheServersWindowAtTheEndOfTheLink) {
  const MessageServer server(backplane_, "dac");
  const auto before = mappings();
  connector_.setServer("dac", 0);
  ASSERT_TRUE(connector_.tryOpenLink(connector_.tryFindServer(), sender_));
  EXPECT_EQ(mappings(), before + 1);

  connector_.closeLink(sender_);

  EXPECT_EQ(mappings(), before);
}

// This process may have no right to remove the files of a dead server. Here they stay until the
// watcher reports the death, up to 100 ms later.
TEST_F(ConnectorTest, TriesADeadServerWhoseWindowStaysOnlyAfterAPause) {
  const DeadServer dead(backplane_.name(), serverWindow());
  connector_.setServer("dac", 0);
  const auto window = connector_.tryFindServer();
  ASSERT_TRUE(window);
  const auto hints =
      SegmentName::keyed(backplane_.name(), NameKind::hints, window->header().incarnation);
  ASSERT_TRUE(connector_.tryOpenLink(window, sender_));
  connector_.closeLink(sender_);

  EXPECT_FALSE(connector_.tryFindServer());

  EXPECT_TRUE(hasPendingBind());
  const bool stayed = segments::exists(serverWindow()) && segments::exists(hints);
  EXPECT_TRUE(!stayed || !parts_.timer.due().isNever()) << "no second try is due";
}

TEST_F(ConnectorTest, WithdrawsThePendingBindWhenTheServerStarts) {
  connector_.setServer("dac", 0);
  ASSERT_FALSE(connector_.tryFindServer());
  const MessageServer server(backplane_, "dac");
  const auto window = connector_.tryFindServer();

  ASSERT_TRUE(connector_.tryOpenLink(window, sender_));
  connector_.askForAcceptance(sender_.channel()->link(), *owner_);

  EXPECT_FALSE(hasPendingBind());
  connector_.closeLink(sender_);
}

TEST_F(ConnectorTest, ABindAfterTheEndChangesNothing) {
  owner_->leave();

  owner_->setServer("dac", 0);

  EXPECT_TRUE(owner_->hasLeft());
}

}  // namespace
}  // namespace mpf::test
