// SPDX-License-Identifier: MIT
// OwnWindow and PeerWindow: what a process exposes, and what its peers see.
#include "shm/window.h"

#include <sys/stat.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <memory>
#include <thread>

#include "base/system_call.h"
#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using testing::AllOf;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

class WindowTest : public ShmTest {
 protected:
  std::unique_ptr<OwnWindow> makeServer(Rights rights = {}) const {
    return std::make_unique<OwnWindow>(name(), SegmentKind::serverWindow, serverName(), rights,
                                       [](layout::SegmentHeader&) {});
  }
  std::unique_ptr<OwnWindow> makeClient() const {
    return std::make_unique<OwnWindow>(name(), SegmentKind::clientWindow, "", Rights{},
                                       [](layout::SegmentHeader&) {});
  }
  std::shared_ptr<PeerWindow> openServer() const {
    return PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  }
  [[nodiscard]] static mode_t modeOf(const std::string& file) {
    struct stat status{};
    EXPECT_EQ(::stat(segments::path(file).c_str(), &status), 0) << file;
    return status.st_mode & 07777;
  }
};

TEST_F(WindowTest, CreatesAndRemovesItsHintsAndFifo) {
  auto server = makeServer();
  auto client = makeClient();

  const auto key = server->header().incarnation;
  const auto clientKey = client->header().incarnation;
  EXPECT_THAT(backplane_.segmentNames(),
              UnorderedElementsAre(serverName(), SegmentName::keyed(name(), NameKind::hints, key),
                                   SegmentName::keyed(name(), NameKind::fifo, key),
                                   SegmentName::keyed(name(), NameKind::clientWindow, clientKey),
                                   SegmentName::keyed(name(), NameKind::hints, clientKey),
                                   SegmentName::keyed(name(), NameKind::fifo, clientKey)));
  server.reset();
  EXPECT_EQ(backplane_.segmentNames().size(), 3u);
}

// For example by RemoveIPC of systemd-logind, and then its server is started once more.
TEST_F(WindowTest, AWindowWhoseNameWasRemovedLeavesItToItsSuccessor) {
  auto server = makeServer();
  ASSERT_TRUE(segments::remove(serverName()));
  const auto successor = makeServer();

  server.reset();

  EXPECT_TRUE(openServer());
}

TEST_F(WindowTest, IsDescribedBeforeItHasItsName) {
  std::vector<std::string> seen{"not called"};

  OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                   [&](layout::SegmentHeader& header) {
                     seen = backplane_.segmentNames();
                     header.location = 5;
                   });

  EXPECT_THAT(seen, testing::IsEmpty());
  EXPECT_EQ(openServer()->header().location, 5);
  EXPECT_EQ(window.header().location, 5);
}

TEST_F(WindowTest, PeersMayWriteTheHintsAndReadTheRest) {
  const auto server = makeServer({.mode = 0666});
  const auto key = server->header().incarnation;

  EXPECT_EQ(modeOf(serverName()), 0644u);
  EXPECT_EQ(modeOf(SegmentName::keyed(name(), NameKind::hints, key)), 0666u);
  EXPECT_EQ(modeOf(SegmentName::keyed(name(), NameKind::fifo, key)), 0666u);
}

TEST_F(WindowTest, IsOnlyForItsOwnersUserUnlessRightsSayOtherwise) {
  const auto server = makeServer();

  for (const auto& file : backplane_.segmentNames()) EXPECT_EQ(modeOf(file), 0600u) << file;
}

TEST_F(WindowTest, RefusesANameInUseAndNamesTheOwner) {
  const auto first = makeServer();

  const auto why = whatOf<NameInUse>([&] { static_cast<void>(makeServer()); });

  EXPECT_THAT(why, AllOf(HasSubstr(segments::path(serverName())), HasSubstr("shm_test"),
                         HasSubstr(std::to_string(::getpid()))));
  EXPECT_EQ(backplane_.segmentNames().size(), 3u) << "the second window left no files";
  EXPECT_TRUE(openServer()->hasOwner());
}

TEST_F(WindowTest, ChecksWhetherANameIsFree) {
  checkNameIsFree(serverName());
  auto server = makeServer();

  EXPECT_THAT(whatOf<NameInUse>([&] { checkNameIsFree(serverName()); }),
              AllOf(HasSubstr(segments::path(serverName())), HasSubstr("shm_test"),
                    HasSubstr(std::to_string(::getpid()))));

  server.reset();
  checkNameIsFree(serverName());
}

TEST_F(WindowTest, ReplacesTheWindowOfAKilledOwnerAtOnce) {
  Child child([&](Child::Self& self) {
    const auto server = makeServer();
    self.stay();
  });
  const auto old = openServer();
  child.end(SIGKILL);

  const auto server = makeServer();

  EXPECT_FALSE(old->hasOwner());
  EXPECT_TRUE(openServer()->hasOwner());
  EXPECT_NE(openServer()->header().incarnation, old->header().incarnation);
  static_cast<void>(backplane_.removeDead());
}

TEST_F(WindowTest, AReaperIsNotMistakenForTheOwner) {
  Child child([&](Child::Self& self) {
    const auto server = makeServer();
    self.stay();
  });
  child.end(SIGKILL);
  FileDescriptor reaper(
      checkCall(::open(segments::path(serverName()).c_str(), O_RDWR | O_CLOEXEC), "open"));
  struct flock64 lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = 1;
  lock.l_len = 1;
  checkCall(::fcntl(reaper.get(), F_OFD_SETLK, &lock), "lock");

  EXPECT_FALSE(openServer()->hasOwner());
  EXPECT_EQ(segments::probeOwner(serverName()), segments::Owner::dead);
  EXPECT_FALSE(segments::removeIfOwnerless(serverName()));
  EXPECT_THAT(whatOf<SegmentError>([&] { makeServer(); }),
              testing::HasSubstr("left by a dead process of user"));

  reaper.reset();
  EXPECT_TRUE(makeServer());
  static_cast<void>(backplane_.removeDead());
}

// The reaper holds the lock but gets no processor.
TEST_F(WindowTest, WaitsForASlowReaper) {
  Child child([&](Child::Self& self) {
    const auto server = makeServer();
    self.stay();
  });
  child.end(SIGKILL);
  FileDescriptor reaper(
      checkCall(::open(segments::path(serverName()).c_str(), O_RDWR | O_CLOEXEC), "open"));
  struct flock64 lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = 1;
  lock.l_len = 1;
  checkCall(::fcntl(reaper.get(), F_OFD_SETLK, &lock), "lock");
  std::jthread slow([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    reaper.reset();
  });

  EXPECT_TRUE(makeServer());

  slow.join();
  static_cast<void>(backplane_.removeDead());
}

TEST_F(WindowTest, OneOfManySuccessorsOfAKilledOwnerGetsTheName) {
  for (int round = 0; round < 20; ++round) {
    Child child([&](Child::Self& self) {
      const auto server = makeServer();
      self.stay();
    });
    child.end(SIGKILL);
    std::atomic<int> wins{0};
    std::atomic<int> tried{0};
    std::vector<std::thread> successors;
    for (int i = 0; i < 3; ++i) {
      successors.emplace_back([&] {
        std::unique_ptr<OwnWindow> server;
        if (whatOf<NameInUse>([&] { server = makeServer(); }).empty()) ++wins;
        for (++tried; tried < 3;) std::this_thread::yield();
      });
    }
    for (auto& successor : successors) successor.join();

    ASSERT_EQ(wins, 1);
    static_cast<void>(backplane_.removeDead());
  }
}

// A file without an owner that this process cannot remove, for example because it is another
// user's.
TEST_F(WindowTest, ADeadWindowThatCannotBeRemovedIsAnError) {
  const auto path = segments::path(serverName());
  ASSERT_EQ(::mkdir(path.c_str(), 0700), 0);

  const auto why = whatOf<SegmentError>([&] { static_cast<void>(makeServer()); });

  EXPECT_THAT(why, HasSubstr(path));
  ASSERT_EQ(::rmdir(path.c_str()), 0);
}

TEST_F(WindowTest, AWindowOfAnotherUserIsNotCalledInUse) {
  constexpr uid_t kNobody = 65534;
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  Child child([&](Child::Self& self) {
    const auto server = makeServer();
    self.stay();
  });
  child.end(SIGKILL);

  ASSERT_EQ(::seteuid(kNobody), 0);
  const auto why = whatOf<NameInUse>([&] { static_cast<void>(makeServer()); });
  ASSERT_EQ(::seteuid(0), 0);

  EXPECT_THAT(why, HasSubstr("belongs to user root, and only that user can tell"));
  EXPECT_THAT(why, HasSubstr("`mpf clean` as that user removes it"));
  static_cast<void>(backplane_.removeDead());
}

TEST_F(WindowTest, AFailedConstructionLeavesNothing) {
  std::string pipe;

  const auto why = whatOf<std::system_error>([&] {
    OwnWindow(
        name(), SegmentKind::serverWindow, serverName(), {}, [&](layout::SegmentHeader& header) {
          pipe = segments::path(SegmentName::keyed(name(), NameKind::fifo, header.incarnation));
          std::ofstream{pipe};
        });
  });

  EXPECT_THAT(why, HasSubstr(pipe));
  ::unlink(pipe.c_str());
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(WindowTest, APeerWindowStaysValidAndSeesThatTheWindowIsClosed) {
  auto server = makeServer();
  const auto peer = openServer();
  EXPECT_FALSE(peer->isClosed());
  EXPECT_TRUE(peer->hasOwner());

  server.reset();

  EXPECT_TRUE(peer->isClosed());
  EXPECT_FALSE(peer->hasOwner());
  peer->notify(0);
  peer->knock(1);
}

TEST_F(WindowTest, IsNotOpenedWithoutItsNameOrItsHints) {
  EXPECT_EQ(openServer(), nullptr);
  const auto server = makeServer();
  segments::remove(SegmentName::keyed(name(), NameKind::hints, server->header().incarnation));

  EXPECT_EQ(openServer(), nullptr);
}

TEST_F(WindowTest, RefusesAWindowThatIsTooShortAndNamesIt) {
  const auto server = makeServer();
  constexpr auto kBytes = layout::kWindowBytes - 1;
  Segment::tryOpen(serverName(), SegmentKind::serverWindow, Segment::Access::readWrite)
      ->sharedHeader()
      .totalBytes = kBytes;
  ASSERT_EQ(::truncate(segments::path(serverName()).c_str(), static_cast<off_t>(kBytes)), 0);

  EXPECT_THAT(whatOf<SegmentError>([&] { openServer(); }),
              AllOf(HasSubstr(segments::path(serverName())), HasSubstr("truncated")));
}

TEST_F(WindowTest, NotifySetsTheReadyBitForEveryIndex) {
  const auto server = makeServer();
  const auto peer = openServer();
  const auto& hints = server->hints();

  peer->notify(64 * 65 + 3);

  EXPECT_EQ(hints.readyBits[65].load(std::memory_order_relaxed), 8u);
  EXPECT_EQ(hints.readyWords[1].load(std::memory_order_relaxed), 2u);
  peer->notify(UINT32_MAX);
  EXPECT_EQ(hints.readyBits[layout::kMaxLinks / 64 - 1].load(std::memory_order_relaxed),
            std::uint64_t{1} << 63);
}

TEST_F(WindowTest, AKnockThatOverwritesAnotherRequestsARescan) {
  const auto server = makeServer();
  const auto peer = openServer();
  const auto& hints = server->hints();

  peer->knock(5);
  peer->knock(5);
  EXPECT_EQ(hints.rescan.load(std::memory_order_relaxed), 0u);
  peer->knock(5 + layout::kKnocks);

  EXPECT_EQ(hints.knocked.load(std::memory_order_relaxed), 3u);
  EXPECT_EQ(hints.rescan.load(std::memory_order_relaxed), 1u);
}

TEST_F(WindowTest, RingsOnlyASleepingOwner) {
  const auto server = makeServer();
  const auto peer = openServer();
  auto& bell = server->hints().bell;
  const auto rung = [&] { return bell.load(std::memory_order_relaxed); };

  peer->notify(0);
  EXPECT_EQ(rung(), 0u) << "awake";
  server->control().sleeping.store(layout::SleepState::onFutex, std::memory_order_relaxed);
  peer->notify(0);
  EXPECT_EQ(rung(), 1u);
  server->control().sleeping.store(layout::SleepState::onDescriptor, std::memory_order_relaxed);
  peer->notify(0);

  EXPECT_EQ(rung(), 1u);
  char byte = 0;
  EXPECT_EQ(::read(server->fifo().get(), &byte, 1), 1) << "rung through the FIFO";
  server->control().sleeping.store(static_cast<layout::SleepState>(77), std::memory_order_relaxed);
  peer->notify(0);
}

class AdmittedPeers : public ShmTest {
 protected:
  [[nodiscard]] std::string rightsOf(NameKind kind) const {
    struct stat status{};
    checkCall(
        ::stat(
            segments::path(SegmentName::keyed(name(), kind, client_.header().incarnation)).c_str(),
            &status),
        "stat");
    std::array<char, 32> text;
    std::snprintf(text.data(), text.size(), "%04o %u", status.st_mode & 07777u, status.st_gid);
    return text.data();
  }
  void TearDown() override {}
  static constexpr std::uint32_t kOperators = 54321;
  OwnWindow client_{
      name(), SegmentKind::clientWindow, "", {.mode = 0644}, [](layout::SegmentHeader&) {}};
};

TEST_F(AdmittedPeers, IncludeOnlyTheOwnerAtFirst) {
  EXPECT_THAT(rightsOf(NameKind::clientWindow), testing::StartsWith("0644"));
  EXPECT_THAT(rightsOf(NameKind::hints), testing::StartsWith("0644"));
  EXPECT_THAT(rightsOf(NameKind::fifo), testing::StartsWith("0600"));
}

TEST_F(AdmittedPeers, OfTheSameUserChangeNoRights) {
  client_.admit({.mode = 0600});

  EXPECT_THAT(rightsOf(NameKind::hints), testing::StartsWith("0644"));
}

TEST_F(AdmittedPeers, OfAGroupMayWriteHintsAndFifo) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may give files to any group";
  client_.admit({.mode = 0660, .group = kOperators});

  EXPECT_EQ(rightsOf(NameKind::hints), "0664 54321");
  EXPECT_EQ(rightsOf(NameKind::fifo), "0660 54321");
}

TEST_F(AdmittedPeers, OfTwoGroupsOpenTheHintsToEveryUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may give files to any group";
  client_.admit({.mode = 0660, .group = kOperators});
  client_.admit({.mode = 0660, .group = kOperators + 1});

  EXPECT_THAT(rightsOf(NameKind::hints), testing::StartsWith("0666"));
  EXPECT_THAT(rightsOf(NameKind::fifo), testing::StartsWith("0666"));
}

}  // namespace
}  // namespace mpf::test
