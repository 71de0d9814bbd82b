// SPDX-License-Identifier: MIT
// Dissection of windows, hints, pools and other segments, and of invalid contents.
#include "tools/inspect/dissect.h"

#include <unistd.h>

#include <filesystem>

#include "router/statistics.h"
#include "shm/window.h"
#include "tests/support/temporary_folder.h"
#include "tests/tools/one_link.h"
#include "tests/tools/report/router_rows.h"

namespace mpf::tools {
namespace {

using layout::SegmentKind;
using testing::HasSubstr;
using testing::StartsWith;

class DissectTest : public test::OneLinkTest {
 protected:
  [[nodiscard]] Tree dissect(const std::string& segment, const DissectOptions& options = {}) const {
    const auto tree = tryDissect(segments::path(segment), options);
    EXPECT_TRUE(tree) << segment;
    return tree.value_or(Tree());
  }
  [[nodiscard]] std::string windowName() const {
    return SegmentName::serverWindow(name(), 2, "dac");
  }
  // Publishes a page of this kind, whose header `change` has changed, and dissects it.
  template <class Change>
  Tree dissectPage(SegmentKind kind, Change change) const {
    auto page = createPage(kind);
    change(page.sharedHeader());
    const auto segment = SegmentName::keyed(name(), NameKind::pendingBind, 0x77);
    EXPECT_TRUE(page.tryPublish(segment));
    auto tree = dissect(segment);
    segments::remove(segment);
    return tree;
  }
};

TEST_F(DissectTest, AMissingFileIsNotAnError) {
  EXPECT_EQ(tryDissect("/nowhere/mpf.a.s.0.dac", {}), std::nullopt);
}

TEST_F(DissectTest, AFileThatIsNotASegmentIsAnError) {
  const test::TemporaryFolder folder;

  EXPECT_THROW(static_cast<void>(tryDissect(folder.write("x", "notes"), {})), SegmentError);
}

TEST_F(DissectTest, EachSegmentHasItsOwner) {
  openServer();

  const auto tree = dissect(windowName());

  EXPECT_EQ(tree.at("file"), segments::path(windowName()));
  EXPECT_EQ(tree.at("kind"), "server window");
  EXPECT_EQ(tree.at("layout"),
            std::to_string(layout::kMajor) + "." + std::to_string(layout::kMinor));
  EXPECT_EQ(tree.at("bytes"), std::filesystem::file_size(segments::path(windowName())));
  EXPECT_EQ(tree.at("backplane"), name());
  EXPECT_THAT(tree.at("created").get<std::string>(), testing::MatchesRegex("20..-..-..T..:..:..Z"));
  const auto& owner = tree.at("owner");
  EXPECT_EQ(owner.at("pid"), ::getpid());
  EXPECT_EQ(owner.at("user"), ::getuid());
  EXPECT_EQ(owner.at("window"), tree.at("incarnation"));
  EXPECT_FALSE(tree.contains("raw"));
}

TEST_F(DissectTest, AServerWindowHasItsOfferItsCountersAndItsHints) {
  connect(17);
  sendValue(5);
  handle(1);
  const auto peer = PeerWindow::tryOpen(windowName(), SegmentKind::serverWindow);
  peer->notify(300);
  peer->knock(0x77);

  const auto tree = dissect(windowName());

  EXPECT_EQ(tree.at("name"), "dac");
  EXPECT_EQ(tree.at("location"), 2);
  EXPECT_EQ(tree.at("offers").at("queue_size"), 17);
  EXPECT_EQ(tree.at("offers").at("link_mode"), "0600");
  const auto& control = tree.at("control");
  EXPECT_EQ(control.at("state"), "open");
  EXPECT_EQ(control.at("link_count"), 1);
  EXPECT_EQ(control.at("received"), 1);
  EXPECT_EQ(control.at("sent"), 1);
  EXPECT_EQ(control.at("handling"), "0");
  const auto& hints = tree.at("hints");
  EXPECT_EQ(hints.at("kind"), "hints");
  EXPECT_THAT(hints.at("ready"), testing::Contains(300));
  EXPECT_THAT(hints.at("knocks"), testing::Contains("77"));
}

TEST_F(DissectTest, AClientWindowOffersNothing) {
  connect();
  const auto client = dissect(linkName()).at("client_side").at("window").get<std::string>();

  const auto tree =
      dissect(SegmentName::keyed(name(), NameKind::clientWindow, std::stoull(client, nullptr, 16)));

  EXPECT_EQ(tree.at("kind"), "client window");
  EXPECT_EQ(tree.at("incarnation"), client);
  EXPECT_FALSE(tree.contains("offers"));
  EXPECT_TRUE(tree.contains("control"));
}

// The files of a copy are all in the folder of the copy.
TEST_F(DissectTest, SaysWhichHintsAreMissing) {
  openServer();
  const test::TemporaryFolder folder;
  std::filesystem::copy_file(segments::path(windowName()), folder.file("copy"));

  const auto tree = tryDissect(folder.file("copy"), {});

  ASSERT_TRUE(tree);
  const auto problem = tree->at("hints").at("problem").get<std::string>();
  EXPECT_THAT(problem, StartsWith(folder.path().string() + "/mpf." + name() + ".h."));
  EXPECT_THAT(problem, testing::EndsWith(": the file does not exist"));
}

// A name of a backplane must not lead to a file outside the folder.
TEST_F(DissectTest, RefusesABackplaneNameThatIsAPath) {
  const auto tree = dissectPage(SegmentKind::serverWindow, [](layout::SegmentHeader& header) {
    header.backplane = {'.', '.', '/', 'x'};
  });

  EXPECT_EQ(tree.at("backplane"), "../x");
  EXPECT_THAT(tree.at("hints").at("problem").get<std::string>(), HasSubstr("\"../x\""));
}

TEST_F(DissectTest, EscapesControlCharacters) {
  const auto tree = dissectPage(SegmentKind::pendingBind, [](layout::SegmentHeader& header) {
    header.name = {'a', '\x1b', 'b'};
    header.location = 7;
  });

  EXPECT_EQ(tree.at("kind"), "pending bind");
  EXPECT_EQ(tree.at("server"), R"(a\x1bb)");
  EXPECT_EQ(tree.at("location"), 7);
}

TEST_F(DissectTest, ABulkSegmentHasItsChunks) {
  const auto tree = dissectPage(SegmentKind::bulk, [](layout::SegmentHeader& header) {
    header.chunkBytes = 128;
    header.chunkCount = 3;
    header.bulkSide = 1;
  });

  EXPECT_EQ(tree.at("kind"), "bulk");
  EXPECT_EQ(tree.at("chunk_bytes"), 128);
  EXPECT_EQ(tree.at("chunk_count"), 3);
  EXPECT_EQ(tree.at("side"), 1);
}

TEST_F(DissectTest, AFanOutSegmentHasItsChunkAndItsServer) {
  const auto tree = dissectPage(SegmentKind::fanOut, [](layout::SegmentHeader& header) {
    header.chunkBytes = 4096;
    header.serverWindow = 0xabc;
  });

  EXPECT_EQ(tree.at("kind"), "fan-out");
  EXPECT_EQ(tree.at("chunk_bytes"), 4096);
  EXPECT_EQ(tree.at("server_window"), "abc");
}

TEST_F(DissectTest, AKindOfALaterReleaseIsAProblem) {
  const auto tree = dissectPage(SegmentKind::pendingBind, [](layout::SegmentHeader& header) {
    header.kind = static_cast<SegmentKind>(99);
  });

  EXPECT_EQ(tree.at("kind"), "unknown");
  EXPECT_EQ(tree.at("problem"), "kind 99 is unknown to this program");
}

TEST_F(DissectTest, AnImpossibleTimeOrStateIsUnknown) {
  openServer();
  const auto window = openForWriting(windowName(), SegmentKind::serverWindow);
  window.at<layout::WindowControl>(layout::kWindowControlOffset)
      .state.store(static_cast<layout::WindowState>(9));

  EXPECT_EQ(dissect(windowName()).at("control").at("state"), "unknown 9");
}

TEST_F(DissectTest, ARouterHasItsConnections) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = test::connectedRemote(statistics, {1, 2});

  const auto tree = dissect(backplane_.segmentNames().at(0));

  EXPECT_EQ(tree.at("kind"), "router");
  EXPECT_EQ(tree.at("name"), "lab1");
  ASSERT_EQ(tree.at("lines").size(), 1U);
  const auto& line = tree.at("lines").at(0);
  EXPECT_EQ(line.at("role"), "client");
  EXPECT_EQ(line.at("state"), "connected");
  EXPECT_EQ(line.at("address"), "10.0.0.7:9900");
  EXPECT_EQ(line.at("peer"), "ioc1");
  EXPECT_EQ(line.at("locations"), "1, 2");
  EXPECT_EQ(line.at("round_trip_ns"), 81'200);
}

TEST_F(DissectTest, RawBytesAreHexadecimalDigits) {
  openServer();

  const auto raw = dissect(windowName(), {.raw = true}).at("raw").get<std::string>();

  EXPECT_EQ(raw.size(), 2 * std::filesystem::file_size(segments::path(windowName())));
  EXPECT_THAT(raw, StartsWith("4d50462d57494e31")) << "MPF-WIN1";
}

TEST(Hex, HasNoLeadingZeroes) {
  EXPECT_EQ(hex(0), "0");
  EXPECT_EQ(hex(0xabc), "abc");
  EXPECT_EQ(hex(UINT64_MAX), "ffffffffffffffff");
}

}  // namespace
}  // namespace mpf::tools
