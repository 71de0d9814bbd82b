// SPDX-License-Identifier: MIT
// The checks of `mpf torture`, on a server and a client of this process.
#include "tools/torture/checks.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <mpf/file_descriptor.h>
#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/shm/shm_fixture.h"

namespace mpf::torture {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class TortureChecks : public test::ShmTest {
 protected:
  void connect(MessageClient& client) {
    client.bind("dac", 0);
    while (!client.isConnected()) {
      server_->handleOne();
      dispatcher_->runOnce(Deadline::after(100us));
    }
  }
  // A segment that no window or link owns.
  std::string leave(const std::string& leftName, layout::SegmentKind kind) const {
    auto segment = createPage(kind);
    segment.sharedHeader().ownerWindow = 0xdead;
    EXPECT_TRUE(segment.tryPublish(leftName));
    return leftName;
  }
  // The server's counters, which the test changes.
  [[nodiscard]] Segment window() const {
    return std::move(*Segment::tryOpen(serverName("dac"), layout::SegmentKind::serverWindow,
                                       Segment::Access::readWrite));
  }
  static layout::WindowControl& controlOf(const Segment& window) {
    return window.at<layout::WindowControl>(layout::kWindowControlOffset);
  }

  void TearDown() override {
    dispatcher_.reset();
    server_.reset();
    ShmTest::TearDown();
  }

  std::optional<MessageServer> server_{std::in_place, backplane_, "dac"};
  std::optional<Dispatcher> dispatcher_{std::in_place, backplane_};
};

TEST_F(TortureChecks, SegmentsOfLivingProcessesAreNotStale) {
  MessageClient client(*dispatcher_, [](const Message&) {});
  connect(client);
  MessageClient waiting(*dispatcher_, [](const Message&) {});
  waiting.bind("absent", 0);
  while (waiting.notConnectedBecause().find("not running") == std::string::npos)
    dispatcher_->runOnce(Deadline::after(100us));
  ASSERT_EQ(client.send(client.alloc<Float64Array>(100'000)), SendResult::sent);

  EXPECT_THAT(staleSegments(name(), 1), IsEmpty());
}

TEST_F(TortureChecks, MoreLinksThanClientsAreStale) {
  MessageClient first(*dispatcher_, [](const Message&) {});
  MessageClient second(*dispatcher_, [](const Message&) {});
  connect(first);
  connect(second);

  EXPECT_THAT(staleSegments(name(), 1), ElementsAre("2 links where 1 are connected"));
  EXPECT_THAT(staleSegments(name(), 2), IsEmpty());
}

TEST_F(TortureChecks, SegmentsWithoutALivingOwnerAreStale) {
  using layout::SegmentKind;
  const std::vector<std::string> left{
      leave(SegmentName::serverWindow(name(), 0, "gone"), SegmentKind::serverWindow),
      leave(SegmentName::keyed(name(), NameKind::hints, 0xdead), SegmentKind::hints),
      leave(SegmentName::keyed(name(), NameKind::pendingBind, 0xbad), SegmentKind::pendingBind),
      leave(SegmentName::link(name(), 0xdead, 0xbee), SegmentKind::link),
      leave(SegmentName::bulk(name(), 0xbee, 0, 0), SegmentKind::bulk)};

  EXPECT_THAT(staleSegments(name(), 0), testing::UnorderedElementsAreArray(left));

  for (const auto& each : left) segments::remove(each);
}

TEST_F(TortureChecks, ALinkOfALivingServerIsStaleWithoutItsClient) {
  const auto link = leave(SegmentName::link(name(), window().header().incarnation, 0xbee),
                          layout::SegmentKind::link);

  EXPECT_THAT(staleSegments(name(), 5), ElementsAre(link));

  segments::remove(link);
}

TEST_F(TortureChecks, FindsTheIncarnationOfAServer) {
  EXPECT_EQ(incarnationOf(name(), "dac"), window().header().incarnation);
  EXPECT_EQ(incarnationOf(name(), "absent"), 0U);
}

TEST_F(TortureChecks, NamesTheProcessThatReceivedInvalidData) {
  EXPECT_NO_THROW(checkNoProtocolErrors(name()));

  controlOf(window()).protocolErrors.store(1);

  EXPECT_EQ(test::whatOf<Broken>([&] { checkNoProtocolErrors(name()); }),
            "dac received invalid data from a peer");
}

TEST_F(TortureChecks, CountsTheLinksThatAServerHasNotClosed) {
  EXPECT_EQ(openLinks(name(), "dac"), 0U);
  {
    MessageClient client(*dispatcher_, [](const Message&) {});
    connect(client);
    EXPECT_EQ(openLinks(name(), "dac"), 1U);
  }
  while (openLinks(name(), "dac") != 0) server_->handleOne();
  EXPECT_EQ(openLinks(name(), "another"), 0U);
}

TEST_F(TortureChecks, CountsTheClientsThatDied) {
  controlOf(window()).peersDied.store(3);

  EXPECT_EQ(clientsDied(name(), "dac"), 3U);
  EXPECT_EQ(clientsDied(name(), "another"), 0U);
}

TEST(Holdings, CountDescriptorsMappingsAndMemory) {
  const auto before = Holdings::of(::getpid());
  const auto path = segments::path("mpf-holdings-test-" + std::to_string(::getpid()));
  FileDescriptor file(
      checkCall(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600), "open", path));
  ASSERT_EQ(::ftruncate(file.get(), 4096), 0);
  void* mapping = ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED, file.get(), 0);
  ASSERT_NE(mapping, MAP_FAILED);

  const auto now = Holdings::of(::getpid());

  EXPECT_EQ(now.descriptors, before.descriptors + 1);
  EXPECT_EQ(now.mappings, before.mappings + 1);
  EXPECT_GT(now.heapKiB, 0U);
  ::munmap(mapping, 4096);
  file.reset();
  EXPECT_EQ(Holdings::of(::getpid()).descriptors, before.descriptors);
  EXPECT_EQ(::unlink(path.c_str()), 0);
}

}  // namespace
}  // namespace mpf::torture
