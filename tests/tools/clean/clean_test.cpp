// SPDX-License-Identifier: MIT
// `mpf clean`: removes files of dead processes, and nothing else.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "shm/segment_name.h"
#include "tests/support/victim.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

std::size_t timesOf(const std::string& word, const std::string& text) {
  std::size_t times = 0;
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size())
    ++times;
  return times;
}

class CleanTest : public ToolsTest {
 protected:
  // Leaves the segments of a server and its client, both killed while messages are outstanding.
  void leaveDeadPair() const {
    Victim server("serve", backplane_.name());
    ASSERT_EQ(server.line(), "open");
    Victim flood("flood", backplane_.name());
    ASSERT_EQ(flood.line(), "connected");
    server.stop();
    flood.end(SIGKILL);
    server.end(SIGKILL);
  }
};

TEST_F(CleanTest, ReportsThatThereIsNothingToRemove) {
  const EchoThread echo(backplane_, "echo");

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.out, "nothing to remove: no dead process left anything\n");
  EXPECT_EQ(run({"call", "echo", "int32", "--timeout", "100"}).status, 0);
}

TEST_F(CleanTest, FailsWhenOutputCannotBeWritten) {
  Victim shell("/bin/sh",
               std::vector<std::string>{"-c", std::string(MPF_TEST_TOOL) + " clean --backplane " +
                                                  backplane_.name() + " >/dev/full 2>/dev/null"});

  EXPECT_EQ(WEXITSTATUS(shell.wait()), 1);
}

TEST_F(CleanTest, CountsFilesThatCannotBeJudged) {
  const auto stray = segments::path("mpf." + backplane_.name() + ".notes");
  std::ofstream(stray) << "x";

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.out, "nothing to remove: no file is known to be of a dead process\n");
  EXPECT_THAT(ended.err,
              HasSubstr("mpf clean: 1 file could not be judged; `mpf clean --dry-run` says why\n"));
  EXPECT_TRUE(std::filesystem::remove(stray));
}

TEST_F(CleanTest, RemovesOnlyFilesOfDeadProcesses) {
  const EchoThread living(backplane_, "living");
  SyncClient client(backplane_, "living", 0);
  ASSERT_TRUE(client.call(Int32Message(), 60s));
  const auto before = backplane_.segmentNames();
  leaveDeadPair();
  std::set<std::string> dead;
  for (const auto& name : backplane_.segmentNames()) {
    if (std::ranges::find(before, name) == before.end()) dead.insert(name);
  }
  ASSERT_FALSE(dead.empty());

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0);
  const auto text = inOneLine(ended.out);
  for (const auto& name : dead)
    EXPECT_THAT(text, HasSubstr("removed " + segments::path(name) + ": "));
  EXPECT_EQ(timesOf("removed", text), dead.size());
  EXPECT_THAT(backplane_.segmentNames(), testing::UnorderedElementsAreArray(before));
  EXPECT_TRUE(client.call(Int32Message(), 60s));
  EXPECT_EQ(run({"clean"}).out, "nothing to remove: no dead process left anything\n");
}

// The server is stopped, so it cannot remove the links itself.
TEST_F(CleanTest, RemovesAThousandLinksOfADeadClient) {
  Victim server("serve", backplane_.name());
  Victim crowd("crowd", backplane_.name(), {"1000"});
  while (!crowd.line().starts_with("answered ")) continue;
  server.stop();
  crowd.end(SIGKILL);

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_GE(timesOf("removed", ended.out), 1000U);
  EXPECT_EQ(backplane_.segmentNames().size(), 3u) << "the server's window, hints and pipe";
  server.signal(SIGCONT);
  server.end(SIGTERM);
}

// A dry run lists exactly the files that are then removed, and changes nothing.
TEST_F(CleanTest, ADryRunReportsWhatWouldBeRemovedAndWhy) {
  const MessageServer living(backplane_, "living");
  leaveDeadPair();
  const auto before = files();

  const auto dryRun = run({"clean", "--dry-run"});

  EXPECT_EQ(dryRun.status, 0);
  EXPECT_TRUE(files() == before);
  EXPECT_THAT(dryRun.out, HasSubstr("s.0.echo:\n  no process holds the lock of"));
  for (const auto& line : linesOf(dryRun.out)) EXPECT_LE(line.size(), 80U) << line;
  EXPECT_THAT(dryRun.out, testing::EndsWith("\n3 files stay: their processes are alive\n"));
  auto expected =
      inOneLine(dryRun.out.substr(0, dryRun.out.rfind('\n', dryRun.out.size() - 2) + 1));
  for (std::size_t at = 0; (at = expected.find("would remove ", at)) != std::string::npos;)
    expected.replace(at, 13, "removed ");
  EXPECT_EQ(inOneLine(run({"clean"}).out), expected);
}

TEST_F(CleanTest, JsonHasVerdictAndReasonOfEachFile) {
  const EchoThread living(backplane_, "living");
  const auto stray = segments::path(SegmentName::prefix(backplane_.name()) + "notes");
  std::ofstream(stray) << "mine";
  const auto dead = SegmentName::keyed(backplane_.name(), NameKind::fifo, 7);
  ASSERT_EQ(::mkfifo(segments::path(dead).c_str(), 0600), 0);

  const auto all = report({"clean"});

  EXPECT_EQ(all.size(), 5U);
  const auto window = entryOf(
      all, "file", segments::path(SegmentName::serverWindow(backplane_.name(), 0, "living")));
  EXPECT_EQ(window.at("verdict"), "alive");
  EXPECT_THAT(window.at("reason").get<std::string>(),
              StartsWith("pid " + std::to_string(::getpid())));
  EXPECT_EQ(entryOf(all, "file", stray).at("verdict"), "unknown");
  EXPECT_EQ(entryOf(all, "file", stray).at("removed"), false);
  EXPECT_EQ(entryOf(all, "file", segments::path(dead)).at("verdict"), "dead");
  EXPECT_EQ(entryOf(all, "file", segments::path(dead)).at("removed"), true);
  std::filesystem::remove(stray);
}

TEST_F(CleanTest, NamesFilesThatAnotherUserOwns) {
  constexpr uid_t kNobody = 65534;
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  if (Tool({"--help"}, "", kNobody).end().status != 0)
    GTEST_SKIP() << "other users cannot execute " << MPF_TEST_TOOL;
  const auto name = SegmentName::serverWindow(backplane_.name(), 0, "left");
  {
    auto window = Segment::create(layout::kWindowBytes, layout::SegmentKind::serverWindow,
                                  backplane_.name(), {.mode = 0644});
    ASSERT_TRUE(window.tryPublish(name));
  }

  const auto ended = Tool({"clean"}, backplane_.name(), kNobody).end();

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err,
            "mpf clean: " + segments::path(name) +
                " belongs to user 0, whose process is dead; that user or root may remove it\n");
  EXPECT_THAT(run({"clean"}).out,
              StartsWith("removed " + segments::path(name) + ":\n  no process holds the lock of"));
}

// Directories and pipes under names of MPF neither block nor end the program.
TEST_F(CleanTest, SurvivesForeignFilesUnderItsNames) {
  const EchoThread echo(backplane_, "echo");
  const auto pathOf = [&](const std::string& rest) {
    return segments::path(SegmentName::prefix(backplane_.name()) + rest);
  };
  for (const char* kind : {"s.0.a", "c.1", "h.1", "l.1.1", "w.1", "b.1.0.0", "f.1"}) {
    std::filesystem::create_directory(pathOf(kind));
  }
  for (const char* kind : {"s.0.b", "c.2", "h.2", "l.1.2", "w.2", "b.2.0.0", "f.2"}) {
    ASSERT_EQ(::mkfifo(pathOf(kind).c_str(), 0600), 0);
  }

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  EXPECT_EQ(run({"call", "echo", "int32", "--timeout", "100"}).status, 0);
  for (const auto& name : backplane_.segmentNames()) {
    if (std::filesystem::is_directory(segments::path(name)))
      std::filesystem::remove(segments::path(name));
  }
  for (const char* kind : {"s.0.b", "c.2", "h.2", "l.1.2", "w.2", "b.2.0.0", "f.2"})
    std::filesystem::remove(pathOf(kind));
}

}  // namespace
}  // namespace mpf::test
