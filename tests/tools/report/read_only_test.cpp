// SPDX-License-Identifier: MIT
// Reports only read: they change nothing, remove nothing, and work when processes hang or are dead.
#include <sys/stat.h>
#include <sys/wait.h>

#include <filesystem>

#include "shm/segment_name.h"
#include "tests/support/victim.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::vector<std::string>> kReports{{"ls"},
                                                     {"mrr"},
                                                     {"msr"},
                                                     {"msr", "echo"},
                                                     {"ls", "--json"},
                                                     {"mrr", "--json"},
                                                     {"msr", "--json"},
                                                     {"top", "--batch", "1"},
                                                     {"inspect"},
                                                     {"inspect", "echo", "--last", "100", "--raw"}};

class ReadOnlyTest : public ToolsTest {
 protected:
  // A client that sends as fast as it can to an echo server; both are stopped at a random moment.
  void wedge() {
    server_ = Victim("serve", backplane_.name());
    EXPECT_EQ(server_.line(), "open");
    client_ = Victim("flood", backplane_.name());
    EXPECT_EQ(client_.line(), "connected");
    while (entryOf(ls().at("servers"), "name", "echo").at("received") == 0) continue;
    for (const auto& victim : {&server_, &client_}) victim->stop();
  }
  // A server whose process was killed.
  void leaveDeadServer(const std::string& name) const {
    auto window = Segment::create(layout::kWindowBytes, layout::SegmentKind::serverWindow,
                                  backplane_.name(), {});
    name.copy(window.sharedHeader().name.data(), name.size());
    EXPECT_TRUE(window.tryPublish(SegmentName::serverWindow(backplane_.name(), 0, name)));
  }
  void TearDown() override {
    server_.end(SIGKILL);
    client_.end(SIGKILL);
    static_cast<void>(backplane_.removeDead());
    ToolsTest::TearDown();  // checks that nothing else is left
  }

  Victim server_;
  Victim client_;
};

TEST_F(ReadOnlyTest, ReportsChangeNoByteAndRemoveNothing) {
  wedge();
  leaveDeadServer("dead");
  const auto before = files();
  ASSERT_GE(before.size(), 6U);

  for (const auto& arguments : kReports) {
    const auto ended = run(arguments);

    EXPECT_EQ(ended.status, 0);
    EXPECT_THAT(ended.err, IsEmpty());
    EXPECT_TRUE(files() == before) << arguments.front();
  }
}

TEST_F(ReadOnlyTest, ATapChangesNoByte) {
  wedge();
  const auto before = files();

  EXPECT_EQ(run({"tap", "echo", "0.05"}).status, 0);

  EXPECT_TRUE(files() == before);
}

TEST_F(ReadOnlyTest, ReportsWorkWhenAllProcessesAreStopped) {
  wedge();

  const auto all = ls();

  const auto server = entryOf(all.at("servers"), "name", "echo");
  EXPECT_EQ(server.at("state"), "stopped");
  EXPECT_EQ(server.at("pid"), server_.pid());
  const auto client = entryOf(all.at("clients"), "pid", client_.pid());
  EXPECT_EQ(client.at("state"), "stopped");
  ASSERT_EQ(client.at("links").size(), 1U);
  EXPECT_EQ(client.at("links").at(0).at("peer_pid"), server_.pid());
}

TEST_F(ReadOnlyTest, ReportsWorkWhenBothSidesAreDead) {
  wedge();
  server_.end(SIGKILL);
  client_.end(SIGKILL);
  const auto before = files();

  const auto all = ls();

  EXPECT_EQ(all.at("servers").at(0).at("state"), "dead");
  EXPECT_EQ(all.at("clients").at(0).at("state"), "dead");
  EXPECT_TRUE(files() == before);
}

// Any user may create files in /dev/shm: reports list them as problems and show everything else.
TEST_F(ReadOnlyTest, ReportsForeignFilesAsProblems) {
  const EchoThread echo(backplane_, "echo");
  const auto pathOf = [&](const std::string& rest) {
    return segments::path(SegmentName::prefix(backplane_.name()) + rest);
  };
  const auto file = pathOf("s.0.file");
  const auto fifo = pathOf("s.0.fifo");
  const auto folder = pathOf("c.1");
  const auto loop = pathOf("l.1.2");
  const auto stray = pathOf("what is this");
  std::ofstream(file) << "junk";
  std::ofstream(stray) << "junk";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::filesystem::create_directory(folder);
  std::filesystem::create_symlink(loop, loop);

  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"ls"}, {"mrr", "--interval", "1ms"}}) {
    const auto ended = run(arguments);

    EXPECT_EQ(ended.status, 0);
    const auto said = inOneLine(ended.out);
    EXPECT_THAT(said, HasSubstr("echo"));
    EXPECT_THAT(said,
                HasSubstr("problem: " + file + ": truncated, 4 bytes are too few for a header"));
    EXPECT_THAT(said,
                HasSubstr("problem: " + fifo + ": not a segment of MPF (not a regular file)"));
    EXPECT_THAT(said,
                HasSubstr("problem: " + folder + ": not a segment of MPF (not a regular file)"));
    EXPECT_THAT(said, HasSubstr("problem: open " + loop + ": "));
    EXPECT_THAT(said, HasSubstr("problem: " + stray + ": not a name that MPF gives"));
  }
  EXPECT_EQ(ls().at("problems").size(), 5U);
  EXPECT_EQ(run({"msr", "echo"}).status, 0);
  for (const auto& path : {file, fifo, folder, loop, stray}) std::filesystem::remove(path);
}

// File names are untrusted, too.
TEST_F(ReadOnlyTest, EscapesControlCharactersInFileNames) {
  const auto path = segments::path(SegmentName::prefix(backplane_.name()) + "\x1b[2J\xc2\x9b");
  std::ofstream(path) << "junk";

  for (const auto& arguments : std::vector<std::vector<std::string>>{{"ls"},
                                                                     {"mrr", "--interval", "1ms"},
                                                                     {"msr"},
                                                                     {"inspect"},
                                                                     {"clean", "--dry-run"},
                                                                     {"clean"}}) {
    const auto ended = run(arguments);

    EXPECT_THAT(ended.out + ended.err,
                testing::Not(testing::AnyOf(HasSubstr("\x1b"), HasSubstr("\xc2\x9b"))))
        << arguments.front();
  }
  EXPECT_THAT(inOneLine(run({"clean", "--dry-run"}).out),
              HasSubstr(R"(.\x1b[2J\u009b stays: not a name that MPF gives)"));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace mpf::test
