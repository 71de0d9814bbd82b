// SPDX-License-Identifier: MIT
// Backplane: its name, its segments, and which of them are removed.
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <vector>

#include "shm/watcher.h"
#include "tests/shm/child.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAreArray;

class BackplaneTest : public ShmTest {
 protected:
  // The segments of a program with a server, a client and a link between them. Without an Endpoint,
  // because threads do not exist in the child of a fork.
  void occupy(Child::Self& self) const {
    OwnWindow server(name(), SegmentKind::serverWindow, serverName(), {},
                     [](layout::SegmentHeader& header) {
                       header.maxMessageBytes = header.maxPoolBytes = 4 << 20;
                       header.linkMode = 0600;
                       header.linkGroup = ~0u;
                     });
    server.control().queueSize.store(8, std::memory_order_relaxed);
    OwnWindow client(name(), SegmentKind::clientWindow, "", {}, [](layout::SegmentHeader&) {});
    const auto link = Link::create(name(), client, 0,
                                   PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow));
    const auto accepted = Link::tryOpen(name(), link->name(), server);
    if (!link->tryAlloc(1000) || !link->tryAlloc(100'000) || !accepted->tryAlloc(1000)) ::_exit(4);
    auto pendingBind = createPage(SegmentKind::pendingBind);
    pendingBind.sharedHeader().ownerWindow = client.header().incarnation;
    if (!pendingBind.tryPublish(
            SegmentName::keyed(name(), NameKind::pendingBind, pendingBind.header().incarnation)))
      ::_exit(5);
    self.stay();
  }
  static constexpr std::size_t kOccupied = 3 + 3 + 1 + 3 + 1;

  OwnWindow makeServer(std::uint16_t layoutMajor = layout::kMajor) const {
    return {name(),
            SegmentKind::serverWindow,
            serverName("living"),
            {},
            [=](layout::SegmentHeader& header) { header.layoutMajor = layoutMajor; }};
  }
};

// attach() examines up to 1024 files. With more files, it must not wait for the names that other
// users created.
TEST_F(BackplaneTest, AttachExaminesOnlySomeOfVeryManyFiles) {
  for (std::uint64_t number = 1; number <= 1500; ++number) {
    std::ofstream{segments::path(SegmentName::keyed(name(), NameKind::pendingBind, number))};
  }

  Backplane::attach(name());

  EXPECT_EQ(backplane_.segmentNames().size(), 1500U - 1024U);
  EXPECT_EQ(backplane_.removeDead().size(), 1500U - 1024U);
}

TEST_F(BackplaneTest, TakesItsNameFromTheCallerTheEnvironmentOrTheDefault) {
  ::setenv("MPF_BACKPLANE", name().c_str(), 1);
  EXPECT_EQ(Backplane::attach().name(), name());
  EXPECT_EQ(Backplane::attach(name() + "x").name(), name() + "x");
  ::setenv("MPF_BACKPLANE", "", 1);
  EXPECT_EQ(Backplane::attach().name(), "default");
  ::unsetenv("MPF_BACKPLANE");
  EXPECT_EQ(Backplane::attach().name(), "default");
}

TEST_F(BackplaneTest, RefusesAnInvalidNameAndNamesIt) {
  EXPECT_THAT(whatOf<std::invalid_argument>([] { Backplane::attach("a.b"); }),
              HasSubstr("\"a.b\""));
  ::setenv("MPF_BACKPLANE", "a/b", 1);
  EXPECT_THAT(whatOf<std::invalid_argument>([] { Backplane::attach(); }), HasSubstr("\"a/b\""));
  ::unsetenv("MPF_BACKPLANE");
}

TEST_F(BackplaneTest, TakesTheDefaultLocationFromTheEnvironmentOrZero) {
  ::unsetenv("MPF_LOCATION");
  EXPECT_EQ(Backplane::defaultLocation(), 0);
  ::setenv("MPF_LOCATION", "7", 1);
  EXPECT_EQ(Backplane::defaultLocation(), 7);
  ::setenv("MPF_LOCATION", "7a", 1);
  EXPECT_THAT(
      whatOf<std::invalid_argument>([] { static_cast<void>(Backplane::defaultLocation()); }),
      HasSubstr("MPF_LOCATION \"7a\""));
  ::setenv("MPF_LOCATION", "\xff", 1);
  EXPECT_THAT(
      whatOf<std::invalid_argument>([] { static_cast<void>(Backplane::defaultLocation()); }),
      HasSubstr("MPF_LOCATION \"\\xff\""));
  ::unsetenv("MPF_LOCATION");
}

TEST_F(BackplaneTest, IsolatedBackplanesHaveDifferentNames) {
  EXPECT_NE(Backplane::isolated().name(), Backplane::isolated().name());
}

TEST_F(BackplaneTest, CopiesShareOneWatcher) {
  const Backplane copy = backplane_;

  EXPECT_EQ(&copy.watcher(), &backplane_.watcher());
}

TEST_F(BackplaneTest, ListsOnlyItsOwnSegments) {
  const auto longer = Backplane::attach(name() + "-x");
  auto ours = createPage();
  auto theirs = createPage();
  ASSERT_TRUE(ours.tryPublish(SegmentName::keyed(name(), NameKind::pendingBind, 1)));
  ASSERT_TRUE(theirs.tryPublish(SegmentName::keyed(longer.name(), NameKind::pendingBind, 1)));

  EXPECT_THAT(backplane_.segmentNames(), ElementsAre(ours.name()));
  EXPECT_THAT(longer.segmentNames(), ElementsAre(theirs.name()));
  const auto names = Backplane::names();
  EXPECT_THAT(names, Contains(name()));
  EXPECT_THAT(names, Contains(longer.name()));
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));

  static_cast<void>(backplane_.removeDead());
  EXPECT_THAT(longer.segmentNames(), ElementsAre(theirs.name()));
  segments::remove(theirs.name());
  EXPECT_THAT(Backplane::names(), Not(Contains(longer.name())));
}

TEST_F(BackplaneTest, RemovesAndReportsTheFilesOfAKilledProcess) {
  Child child([&](Child::Self& self) { occupy(self); });
  const auto left = backplane_.segmentNames();
  EXPECT_EQ(left.size(), kOccupied);
  EXPECT_THAT(backplane_.removeDead(), IsEmpty()) << "it is alive";
  child.stop();
  EXPECT_THAT(backplane_.removeDead(), IsEmpty()) << "it is stopped";

  child.end(SIGKILL);

  EXPECT_THAT(backplane_.removeDead(), UnorderedElementsAreArray(left));
  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
  EXPECT_THAT(backplane_.removeDead(), IsEmpty());
}

TEST_F(BackplaneTest, AttachRemovesTheFilesOfDeadProcesses) {
  Child child([&](Child::Self& self) { occupy(self); });
  child.end(SIGKILL);

  static_cast<void>(Backplane::attach(name()));

  EXPECT_THAT(backplane_.segmentNames(), IsEmpty());
}

TEST_F(BackplaneTest, KeepsTheFilesOfLivingProcesses) {
  Child dying([&](Child::Self& self) { occupy(self); });
  const auto server = makeServer();
  const OwnWindow client(name(), SegmentKind::clientWindow, "", {}, [](layout::SegmentHeader&) {});
  dying.end(SIGKILL);

  EXPECT_EQ(backplane_.removeDead().size(), kOccupied);

  EXPECT_EQ(backplane_.segmentNames().size(), 6u);
}

// The server of the link dies, then its client. The client owns the link.
TEST_F(BackplaneTest, KeepsALinkUntilItsClientDies) {
  Child server([&](Child::Self& self) {
    const OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                           [](layout::SegmentHeader& header) {
                             header.maxPoolBytes = 4 << 20;
                             header.linkMode = 0600;
                             header.linkGroup = ~0u;
                           });
    self.stay();
  });
  Child client([&](Child::Self& self) {
    const OwnWindow window(name(), SegmentKind::clientWindow, "", {},
                           [](layout::SegmentHeader&) {});
    const auto link = Link::create(name(), window, 0,
                                   PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow));
    if (link->tryAlloc(1000)) self.stay();
  });

  server.end(SIGKILL);
  EXPECT_EQ(backplane_.removeDead().size(), 3u);
  EXPECT_EQ(backplane_.segmentNames().size(), 5u) << "window, hints, pipe, link, bulk";
  client.end(SIGKILL);
  EXPECT_EQ(backplane_.removeDead().size(), 5u);
}

TEST_F(BackplaneTest, RemovesAnUnreadableLinkWhenItsClientDies) {
  Child child([&](Child::Self& self) { occupy(self); });
  child.end(SIGKILL);
  for (const auto& file : backplane_.segmentNames()) {
    if (SegmentName::tryParse(file)->kind != NameKind::link) continue;
    ASSERT_EQ(::truncate(segments::path(file).c_str(), 100), 0);
  }

  EXPECT_EQ(backplane_.removeDead().size(), kOccupied);
}

// A program of the next major version on the same backplane: its names and locks have the same
// meaning; its other bytes are unknown to us.
TEST_F(BackplaneTest, KeepsTheFilesOfLivingProgramsOfOtherVersions) {
  const auto server = makeServer(layout::kMajor + 1);
  auto link = createPage(SegmentKind::link);
  link.sharedHeader().layoutMajor = layout::kMajor + 1;
  ASSERT_TRUE(link.tryPublish(SegmentName::link(name(), server.header().incarnation, 7)));
  auto bulk = createPage(SegmentKind::bulk);
  ASSERT_TRUE(bulk.tryPublish(SegmentName::bulk(name(), 7, 0, 0)));

  EXPECT_THAT(backplane_.removeDead(), IsEmpty());

  segments::remove(link.name());
  segments::remove(bulk.name());
}

TEST_F(BackplaneTest, LeavesFilesWithOtherNamesUnchanged) {
  const auto file = segments::path(SegmentName::prefix(name()) + "notes");
  std::ofstream{file} << "mine";

  EXPECT_THAT(backplane_.removeDead(), IsEmpty());

  EXPECT_EQ(::unlink(file.c_str()), 0);
}

// It needs a watcher of its own.
TEST_F(BackplaneTest, TheChildOfAForkThatHasNoDescriptorLeftGetsAnError) {
  Child child([&](Child::Self& self) {
    self.ready();
    const rlimit none{};
    ::setrlimit(RLIMIT_NOFILE, &none);
    EXPECT_THROW(static_cast<void>(backplane_.watcher()), std::system_error);
    ::_exit(HasFailure() ? 1 : 0);
  });

  child.go();

  EXPECT_EQ(child.end(0), 0);
}

TEST_F(BackplaneTest, ManyProcessesMayRemoveAtOnce) {
  constexpr int kReapers = 3;
  for (int round = 0; round < 30; ++round) {
    Child victim([&](Child::Self& self) { occupy(self); });
    std::vector<std::unique_ptr<Child>> reapers;
    for (int i = 0; i < kReapers; ++i) {
      reapers.push_back(std::make_unique<Child>([&](Child::Self& self) {
        self.ready();
        static_cast<void>(backplane_.removeDead());
      }));
    }
    victim.end(SIGKILL);

    for (const auto& reaper : reapers) reaper->go();
    for (const auto& reaper : reapers) ASSERT_EQ(reaper->end(0), 0);

    ASSERT_THAT(backplane_.segmentNames(), IsEmpty()) << "round " << round;
  }
}

}  // namespace
}  // namespace mpf::test
