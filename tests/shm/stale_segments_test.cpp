// SPDX-License-Identifier: MIT
// The verdicts about files of dead and living processes and about unknown files, and their reasons.
#include "shm/stale_segments.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "shm/link.h"
#include "shm/owner_lock.h"
#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using stale_segments::Verdict;
using testing::AllOf;
using testing::HasSubstr;

class StaleSegmentsTest : public ShmTest {
 protected:
  [[nodiscard]] std::map<std::string, stale_segments::Judged> judge() const {
    std::map<std::string, stale_segments::Judged> all;
    for (const auto& file : stale_segments::judge(name())) all.emplace(file.name, file);
    return all;
  }
  [[nodiscard]] stale_segments::Judged judgementOf(const std::string& file) const {
    return judge()[file];
  }
  [[nodiscard]] std::string keyed(NameKind kind, std::uint64_t incarnation) const {
    return SegmentName::keyed(name(), kind, incarnation);
  }
  OwnWindow makeClient() const {
    return {name(), SegmentKind::clientWindow, "", {}, [](layout::SegmentHeader&) {}};
  }
  // Creates a segment of one page with this name that belongs to the window of this incarnation.
  void leave(const std::string& file, SegmentKind kind, std::uint64_t ownerWindow,
             std::uint16_t layoutMajor = layout::kMajor) const {
    auto page = createPage(kind);
    page.sharedHeader().ownerWindow = ownerWindow;
    page.sharedHeader().layoutMajor = layoutMajor;
    EXPECT_TRUE(page.tryPublish(file));
  }
};

TEST_F(StaleSegmentsTest, NamesTheHeldLockForFilesOfLivingProcesses) {
  const auto client = makeClient();
  const auto incarnation = client.header().incarnation;
  const auto pendingBind = keyed(NameKind::pendingBind, 7);
  leave(pendingBind, SegmentKind::pendingBind, incarnation);

  const auto all = judge();

  const auto lock = "pid " + std::to_string(::getpid()) + " (shm_test) holds the lock of ";
  ASSERT_EQ(all.size(), 4U);
  for (const auto& [file, judged] : all) EXPECT_EQ(judged.verdict, Verdict::alive) << file;
  EXPECT_EQ(all.at(keyed(NameKind::clientWindow, incarnation)).reason,
            lock + keyed(NameKind::clientWindow, incarnation));
  // Every peer may overwrite the header of hints, so it is not used to name the owner.
  const auto held = "the lock of " + keyed(NameKind::hints, incarnation) + " is held";
  EXPECT_EQ(all.at(keyed(NameKind::hints, incarnation)).reason, held);
  EXPECT_EQ(all.at(keyed(NameKind::fifo, incarnation)).reason, held);
  EXPECT_EQ(all.at(pendingBind).reason, lock + keyed(NameKind::clientWindow, incarnation));
  EXPECT_FALSE(stale_segments::tryRemove(all.at(pendingBind))) << "its owner is alive";
  segments::remove(pendingBind);
}

TEST_F(StaleSegmentsTest, NamesTheFreeLockForFilesOfDeadProcesses) {
  std::uint64_t incarnation = 0;
  Child child([&](Child::Self& self) {
    const auto client = makeClient();
    self.stay();
  });
  for (const auto& [file, judged] : judge()) incarnation = SegmentName::tryParse(file)->incarnation;
  const auto pendingBind = keyed(NameKind::pendingBind, 7);
  leave(pendingBind, SegmentKind::pendingBind, incarnation);

  child.end(SIGKILL);

  const auto all = judge();
  ASSERT_EQ(all.size(), 4U);
  for (const auto& [file, judged] : all) EXPECT_EQ(judged.verdict, Verdict::dead) << file;
  EXPECT_THAT(
      all.at(pendingBind).reason,
      AllOf(HasSubstr("no process holds the lock of " + keyed(NameKind::clientWindow, incarnation)),
            HasSubstr("pid ")));
  for (const auto& [file, judged] : all) EXPECT_TRUE(stale_segments::tryRemove(judged)) << file;
}

// Somebody keeps a copy of a file, to look at it later.
TEST_F(StaleSegmentsTest, ACopyOfTheWindowOfALivingServerIsNoEvidenceAgainstIt) {
  const auto window = SegmentName::serverWindow(name(), 0, "dac");
  const OwnWindow server(name(), SegmentKind::serverWindow, window, {},
                         [](layout::SegmentHeader& header) { header.name = {"dac"}; });
  const auto incarnation = server.header().incarnation;
  const auto copy = SegmentName::serverWindow(name(), 0, "dac-copy");
  std::filesystem::copy_file("/dev/shm/" + window, "/dev/shm/" + copy);

  const auto all = judge();

  EXPECT_EQ(all.at(copy).verdict, Verdict::dead);
  EXPECT_EQ(all.at(keyed(NameKind::hints, incarnation)).verdict, Verdict::alive);
  EXPECT_EQ(all.at(keyed(NameKind::fifo, incarnation)).verdict, Verdict::alive);
  segments::remove(copy);
}

// A peer keeps a lock on the hints. Texts for people escape some characters of the name.
TEST_F(StaleSegmentsTest, TheWindowOfADeadServerIsEvidenceWhateverItsName) {
  const std::string server = "dac\xc2\xad";
  Child child([&](Child::Self& self) {
    const OwnWindow own(name(), SegmentKind::serverWindow, serverName(server), {},
                        [&](layout::SegmentHeader& header) {
                          server.copy(header.name.data(), header.name.size() - 1);
                        });
    self.stay();
  });
  const auto header =
      segments::tryReadHeader(serverName(server), SegmentKind::serverWindow).value();
  const auto hints = keyed(NameKind::hints, header.incarnation);
  child.end(SIGKILL);
  const FileDescriptor peers(::open(segments::path(hints).c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_TRUE(owner_lock::trySet(peers.get()));

  EXPECT_EQ(judgementOf(hints).verdict, Verdict::dead);

  EXPECT_EQ(backplane_.removeDead().size(), 3u);
}

// Any user may create files that say so, before or after the window in a listing.
TEST_F(StaleSegmentsTest, AnotherSpellingOfTheIncarnationOfAWindowIsNoEvidenceAgainstIt) {
  const auto client = makeClient();
  const auto window = keyed(NameKind::clientWindow, client.header().incarnation);
  const auto incarnation = window.substr(window.rfind('.') + 1);
  const auto pendingBind = keyed(NameKind::pendingBind, 7);
  leave(pendingBind, SegmentKind::pendingBind, client.header().incarnation);
  const std::string prefix = "mpf." + name() + ".c.0";
  leave(prefix + incarnation, SegmentKind::clientWindow, 0);
  std::filesystem::rename("/dev/shm/" + window, "/dev/shm/" + window + "-");
  std::filesystem::rename("/dev/shm/" + window + "-", "/dev/shm/" + window);
  leave(prefix + '0' + incarnation, SegmentKind::clientWindow, 0);

  EXPECT_EQ(judgementOf(pendingBind).verdict, Verdict::alive);

  for (const auto& file : {pendingBind, prefix + incarnation, prefix + '0' + incarnation})
    segments::remove(file);
}

// Any user may create such files.
TEST_F(StaleSegmentsTest, ASecondLinkWithTheSameIncarnationIsNoEvidenceAgainstAPool) {
  const auto client = makeClient();
  const auto link = SegmentName::link(name(), 3, 7);
  const auto pool = SegmentName::bulk(name(), 7, 0, 0);
  leave(SegmentName::link(name(), 2, 7), SegmentKind::link, 99);
  leave(link, SegmentKind::link, client.header().incarnation);
  leave(SegmentName::link(name(), 4, 7), SegmentKind::link, 99);
  leave(pool, SegmentKind::bulk, client.header().incarnation);

  const auto all = judge();

  EXPECT_EQ(all.at(link).verdict, Verdict::alive);
  EXPECT_EQ(all.at(pool).verdict, Verdict::alive);
  // Of fewer files than there are, those of one link may be missing.
  for (int i = 0; i < 200; ++i) {
    for (const auto& file : stale_segments::judgeSome(name(), 4))
      EXPECT_TRUE(file.name != pool || file.verdict == Verdict::alive);
  }
  EXPECT_EQ(backplane_.removeDead().size(), 2u);
  segments::remove(link);
  segments::remove(pool);
}

TEST_F(StaleSegmentsTest, FilesWithoutAnOwnerAreDead) {
  const auto pendingBind = keyed(NameKind::pendingBind, 7);
  leave(pendingBind, SegmentKind::pendingBind, 0x99);
  const auto bulk = SegmentName::bulk(name(), 0x55, 1, 0);
  leave(bulk, SegmentKind::bulk, 0x99);
  const auto fanOut = SegmentName::fanOut(name(), 0x66, 3);
  leave(fanOut, SegmentKind::fanOut, 0x66);
  const auto link = SegmentName::link(name(), 1, 2);
  std::ofstream(segments::path(link)) << "junk";

  EXPECT_EQ(judgementOf(pendingBind).reason,
            "its owner's " + keyed(NameKind::clientWindow, 0x99) + " is gone");
  EXPECT_EQ(judgementOf(bulk).reason, "its link 55 is gone");
  EXPECT_EQ(judgementOf(fanOut).reason, "its owner's " + keyed(NameKind::hints, 0x66) + " is gone");
  EXPECT_THAT(judgementOf(link).reason, HasSubstr("no program can use it: "));
  for (const auto& [file, judged] : judge()) EXPECT_TRUE(stale_segments::tryRemove(judged)) << file;
}

// A client may overwrite the header of its link. Of another version is only a link whose server is.
TEST_F(StaleSegmentsTest, ALinkHasTheVersionOfItsServer) {
  const OwnWindow server(name(), SegmentKind::serverWindow, serverName(), {},
                         [](layout::SegmentHeader&) {});
  const auto invalid = SegmentName::link(name(), server.header().incarnation, 2);
  const auto other = SegmentName::link(name(), 1, 3);
  for (const auto& link : {invalid, other})
    leave(link, SegmentKind::link, 0x99, layout::kMajor + 1);

  EXPECT_EQ(judgementOf(other).verdict, Verdict::unknown);
  EXPECT_THAT(judgementOf(invalid).reason, HasSubstr("no program can use it: "));
  EXPECT_TRUE(stale_segments::tryRemove(judgementOf(invalid)));
  segments::remove(other);
}

// Another process removed the name of a window whose owner is alive.
TEST_F(StaleSegmentsTest, AWindowWithoutANameKeepsItsOtherFiles) {
  const auto client = makeClient();
  const auto pendingBind = keyed(NameKind::pendingBind, 7);
  leave(pendingBind, SegmentKind::pendingBind, client.header().incarnation);

  const auto fanOut = SegmentName::fanOut(name(), client.header().incarnation, 0);
  leave(fanOut, SegmentKind::fanOut, client.header().incarnation);

  segments::remove(keyed(NameKind::clientWindow, client.header().incarnation));

  EXPECT_EQ(judgementOf(fanOut).verdict, Verdict::alive);
  segments::remove(fanOut);
  EXPECT_EQ(judgementOf(pendingBind).verdict, Verdict::alive);
  EXPECT_EQ(judgementOf(pendingBind).reason,
            "the lock of " + keyed(NameKind::hints, client.header().incarnation) + " is held");
  segments::remove(pendingBind);
}

TEST_F(StaleSegmentsTest, DoesNotJudgeUnknownFiles) {
  const auto notes = SegmentName::prefix(name()) + "notes";
  std::ofstream(segments::path(notes)) << "mine";
  leave(serverName("newer"), SegmentKind::serverWindow, 0, layout::kMajor + 1);
  leave(serverName("pendingBind"), SegmentKind::pendingBind, 0);
  leave(keyed(NameKind::pendingBind, 7), SegmentKind::pendingBind, 0, layout::kMajor + 1);
  ASSERT_EQ(::mkfifo(segments::path(serverName("pipe")).c_str(), 0600), 0);

  const auto all = judge();

  ASSERT_EQ(all.size(), 5U);
  for (const auto& [file, judged] : all) {
    EXPECT_EQ(judged.verdict, Verdict::unknown) << file;
    EXPECT_FALSE(stale_segments::tryRemove(judged)) << file;
    segments::remove(file);
  }
  EXPECT_EQ(all.at(notes).reason, "not a name that MPF gives");
  EXPECT_THAT(all.at(serverName("newer")).reason,
              HasSubstr("layout version 2; this program supports 1;"));
}

// A client may overwrite the header of its own window.
TEST_F(StaleSegmentsTest, TheHintsOfAClientTellWhichVersionItsWindowHas) {
  const auto window = keyed(NameKind::clientWindow, 7);
  leave(window, SegmentKind::clientWindow, 0, layout::kMajor + 1);
  EXPECT_EQ(judgementOf(window).verdict, Verdict::unknown);

  leave(keyed(NameKind::hints, 7), SegmentKind::hints, 7);

  EXPECT_EQ(judgementOf(window).verdict, Verdict::dead);
  EXPECT_EQ(backplane_.removeDead().size(), 2U);
}

TEST_F(StaleSegmentsTest, AWindowOfAnotherVersionAndAnotherKindIsSpoiled) {
  const auto window = keyed(NameKind::clientWindow, 7);
  leave(window, SegmentKind::link, 0, layout::kMajor + 1);

  EXPECT_EQ(judgementOf(window).verdict, Verdict::dead);
  EXPECT_EQ(backplane_.removeDead().size(), 1U);
}

// A successor gets the name after the file was judged dead. The removal checks the lock again.
TEST_F(StaleSegmentsTest, DoesNotRemoveASuccessorOfTheSameName) {
  leave(serverName(), SegmentKind::serverWindow, 0);
  const auto judged = judgementOf(serverName());
  ASSERT_EQ(judged.verdict, Verdict::dead);
  const OwnWindow successor(name(), SegmentKind::serverWindow, serverName(), {},
                            [](layout::SegmentHeader&) {});

  EXPECT_FALSE(stale_segments::tryRemove(judged));

  EXPECT_EQ(segments::probeOwner(serverName(), successor.header().incarnation),
            segments::Owner::alive);
}

// Any user may fill /dev/shm with names.
TEST_F(StaleSegmentsTest, JudgesTheRequestedNumberOfManyFiles) {
  for (std::uint64_t number = 1; number <= 200; ++number)
    std::ofstream(segments::path(keyed(NameKind::pendingBind, number)));

  EXPECT_EQ(stale_segments::judgeSome(name(), 50).size(), 50U);
  EXPECT_EQ(stale_segments::judgeSome(name(), 200).size(), 200U);
  EXPECT_EQ(backplane_.removeDead().size(), 200U);
}

// The verdict about a pool is that of its link. If the link was not judged, the pool is not either.
TEST_F(StaleSegmentsTest, DoesNotJudgeAPoolWithoutItsLink) {
  const auto client = makeClient();
  const auto link = SegmentName::link(name(), 1, 2);
  leave(link, SegmentKind::link, client.header().incarnation);
  const auto bulk = SegmentName::bulk(name(), 2, 0, 0);
  leave(bulk, SegmentKind::bulk, client.header().incarnation);

  for (int round = 0; round < 100; ++round) {
    for (const auto& file : stale_segments::judgeSome(name(), 2))
      EXPECT_EQ(file.verdict, Verdict::alive) << file.name;
  }

  segments::remove(link);
  segments::remove(bulk);
}

// A link may be chosen and removed before its pool is chosen.
TEST_F(StaleSegmentsTest, SomeAtATimeRemoveEveryFileOfADeadProcess) {
  for (std::uint64_t link = 1; link <= 20; ++link) {
    leave(SegmentName::link(name(), 1, link), SegmentKind::link, 0x99);
    leave(SegmentName::bulk(name(), link, 0, 0), SegmentKind::bulk, 0x99);
  }

  constexpr int kEnough = 1000;
  for (int round = 0; round < kEnough && !backplane_.segmentNames().empty(); ++round) {
    for (const auto& file : stale_segments::judgeSome(name(), 4))
      static_cast<void>(stale_segments::tryRemove(file));
  }

  EXPECT_TRUE(backplane_.segmentNames().empty());
}

}  // namespace
}  // namespace mpf::test
