// SPDX-License-Identifier: MIT
// Acceptor: clients that knock, lost knocks, unusable links, and shortages.
#include "server/acceptor.h"

#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "tests/server/server_parts_fixture.h"
#include "tests/support/no_descriptors.h"

namespace mpf::test {
namespace {

using layout::LinkState;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

using AcceptorTest = ServerPartsTest;

TEST_F(AcceptorTest, AClientThatKnocksIsAcceptedOnce) {
  auto& link = createLink();
  EXPECT_NE(link.peerState(), LinkState::open);

  knock(link);
  acceptor_.acceptAll();
  knock(link);
  acceptor_.acceptAll();

  EXPECT_EQ(link.peerState(), LinkState::open);
  EXPECT_EQ(valueOf(control().linksOpened), 1u);
}

TEST_F(AcceptorTest, ARescanFindsAClientWhoseKnockIsLost) {
  auto& link = createLink();
  acceptor_.acceptAll();
  ASSERT_NE(link.peerState(), LinkState::open);

  server_->endpoint.window().hints().rescan.store(1, std::memory_order_relaxed);
  acceptor_.acceptAll();

  EXPECT_EQ(link.peerState(), LinkState::open);
}

TEST_F(AcceptorTest, AKnockForALinkThatDoesNotExistIsIgnored) {
  createLink().peer()->knock(12345);

  acceptor_.acceptAll();

  EXPECT_EQ(valueOf(control().linksOpened), 0u);
  EXPECT_EQ(valueOf(control().protocolErrors), 0u);
}

TEST_F(AcceptorTest, ALinkThatItsClientHasClosedIsIgnored) {
  auto& link = createLink();
  link.setState(LinkState::closed);

  knock(link);
  acceptor_.acceptAll();

  EXPECT_EQ(valueOf(control().linksOpened), 0u);
}

TEST_F(AcceptorTest, ALinkWithInvalidDataIsCountedAndOthersAreAccepted) {
  auto& invalid = createLink();
  Segment::tryOpen(invalid.name(), layout::SegmentKind::link, Segment::Access::readWrite)
      ->sharedHeader()
      .queueSlots = 3;
  auto& valid = createLink();

  knock(invalid);
  knock(valid);
  acceptor_.acceptAll();

  EXPECT_NE(invalid.peerState(), LinkState::open);
  EXPECT_EQ(valid.peerState(), LinkState::open);
  EXPECT_EQ(valueOf(control().protocolErrors), 1u);
}

TEST_F(AcceptorTest, WithoutAFreeIndexAClientIsRefused) {
  while (server_->endpoint.tryReserve()) {
  }
  auto& link = createLink();

  knock(link);
  acceptor_.acceptAll();

  EXPECT_EQ(link.peerState(), LinkState::refused);
}

TEST_F(AcceptorTest, AShortageIsOneAlarmUntilAClientIsAccepted) {
  std::vector<std::string> reports;
  acceptor_.onShortage([&](const std::string& why) { reports.push_back(why); });
  auto& link = createLink();

  {
    const NoDescriptors none;
    for (int i = 0; i < 3; ++i) {
      knock(link);
      acceptor_.acceptAll();
    }
  }
  EXPECT_EQ(control().shortage.load(std::memory_order_relaxed), layout::Shortage::descriptors);
  EXPECT_EQ(valueOf(control().alarms), 1u);
  accept(link);

  EXPECT_THAT(reports, ElementsAre(AllOf(HasSubstr("open files"), HasSubstr("ulimit -n")), ""));
  EXPECT_EQ(control().shortage.load(std::memory_order_relaxed), layout::Shortage::none);
  EXPECT_EQ(valueOf(control().protocolErrors), 0u);
}

TEST_F(AcceptorTest, ARescanDuringAShortageIsRepeated) {
  auto& link = createLink();
  const auto requestRescan = [&] {
    server_->endpoint.window().hints().rescan.store(1, std::memory_order_relaxed);
  };

  {
    const NoDescriptors none;
    requestRescan();
    acceptor_.acceptAll();
  }
  EXPECT_EQ(control().shortage.load(std::memory_order_relaxed), layout::Shortage::descriptors);
  while (link.peerState() != LinkState::open) acceptor_.acceptAll();

  EXPECT_EQ(control().shortage.load(std::memory_order_relaxed), layout::Shortage::none);
  EXPECT_EQ(valueOf(control().protocolErrors), 0u);
}

}  // namespace
}  // namespace mpf::test
