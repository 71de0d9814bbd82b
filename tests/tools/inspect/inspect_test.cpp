// SPDX-License-Identifier: MIT
// `mpf inspect`: on running processes, on dead ones, and on copies of their files.
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/random.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/victim.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class InspectTest : public ToolsTest {
 protected:
  // Clients of this process, connected to a server that handles requests only when a test asks.
  void connect(int clients, int queueSize = 20) {
    server_.emplace(backplane_, "dac", ServerOptions{.location = 0, .queueSize = queueSize});
    server_->on<Int32>([](Int32& request) { ++request.value; });
    dispatcher_.emplace(backplane_);
    for (int i = 0; i < clients; ++i) {
      clients_.push_back(std::make_unique<MessageClient>(*dispatcher_, [](const Message&) {}));
      clients_.back()->bind("dac", 0);
    }
    for (auto& client : clients_) {
      while (!client->isConnected()) {
        server_->handleOne();
        dispatcher_->runOnce(Deadline::after(10us));
      }
    }
  }
  void TearDown() override {
    clients_.clear();
    dispatcher_.reset();
    server_.reset();
    ToolsTest::TearDown();
  }
  [[nodiscard]] nlohmann::json summary() const {
    return report({"inspect", "--interval", "1ms"}).at(0);
  }
  [[nodiscard]] nlohmann::json theLink(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"inspect", summary().at("links").at(0).at("link").get<std::string>(),
                               "--interval", "1ms"});
    return report(more).at(0);
  }
  // Copies all files of the backplane, as a user does after a failure.
  void copyAll() const {
    for (const auto& name : backplane_.segmentNames()) {
      if (std::filesystem::is_regular_file(segments::path(name)))
        std::filesystem::copy_file(segments::path(name), folder_ / name);
    }
  }
  static void expectNarrow(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
  std::optional<MessageServer> server_;
  std::optional<Dispatcher> dispatcher_;
  std::vector<std::unique_ptr<MessageClient>> clients_;
};

TEST_F(InspectTest, TheSummaryShowsWhichProcessWaitsForWhich) {
  connect(2);
  EXPECT_THAT(run({"inspect"}).out, HasSubstr("  2 of 2 links idle\n"));
  ASSERT_EQ(clients_.front()->send(Int32Message()), SendResult::sent);

  const auto text = run({"inspect"}).out;

  EXPECT_THAT(
      text, AllOf(HasSubstr("server dac"), HasSubstr("  1 request waits for the server (stalled, "),
                  HasSubstr("  1 of 2 links idle\n")));
  expectNarrow(text);

  while (!server_->handleOne()) continue;
  EXPECT_THAT(run({"inspect"}).out, HasSubstr("    1 reply waits for the client (stalled, "));
  server_.reset();
  EXPECT_THAT(run({"inspect"}).out, HasSubstr("over: the server is gone"));
}

TEST_F(InspectTest, AClientShowsTheServersThatItWaitsFor) {
  connect(1);
  MessageClient waiting(*dispatcher_, [](const Message&) {});
  waiting.bind("later", 3);
  while (ls().at("waiting").empty())
    dispatcher_->runOnce(Deadline::after(std::chrono::microseconds(100)));
  const auto client = ls().at("clients").at(0).at("name").get<std::string>();

  const auto text = run({"inspect", client}).out;

  EXPECT_THAT(text, HasSubstr("  waits for: server later, location 3\n"));
  const auto pendingBinds = report({"inspect", client}).at(0).at("waits_for");
  ASSERT_EQ(pendingBinds.size(), 1U);
  EXPECT_EQ(pendingBinds.at(0).at("server"), "later");
  EXPECT_EQ(pendingBinds.at(0).at("location"), 3);
}

TEST_F(InspectTest, ALinkShowsItsLastMessagesAndTheirStates) {
  connect(1);
  for (int i = 1; i <= 3; ++i)
    ASSERT_EQ(clients_.front()->send(Int32Message({.address = 7, .value = i})), SendResult::sent);
  while (!server_->handleOne()) continue;

  const auto link = theLink();

  const auto& requests = link.at("requests").at("messages");
  ASSERT_THAT(requests, SizeIs(3));
  EXPECT_EQ(requests.at(0).at("state"), "taken");
  EXPECT_EQ(requests.at(1).at("state"), "waiting");
  EXPECT_EQ(requests.at(2).at("state"), "waiting");
  EXPECT_EQ(requests.at(2).at("message").at("value"), 3);
  EXPECT_EQ(requests.at(2).at("text"), "int32 timeout=0 cmd=0 status=0 address=7 extra=0 value=3");
  const auto& replies = link.at("replies").at("messages");
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_EQ(replies.at(0).at("state"), "waiting");
  EXPECT_EQ(replies.at(0).at("first_reply"), true);
  EXPECT_EQ(replies.at(0).at("message").at("value"), 2);
  EXPECT_EQ(replies.at(0).at("request_id"), requests.at(0).at("request_id"));
  EXPECT_THAT(theLink({"--last", "1"}).at("requests").at("messages"), SizeIs(1));
  EXPECT_EQ(
      theLink({"--raw"}).at("requests").at("messages").at(0).at("raw").get<std::string>().size(),
      128U);
}

TEST_F(InspectTest, AServerShowsItsWindowItsHintsAndItsLinks) {
  connect(2);
  ASSERT_EQ(clients_.front()->send(Int32Message()), SendResult::sent);
  const auto peer = PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, "dac"),
                                        layout::SegmentKind::serverWindow);
  peer->notify(300);
  peer->knock(0x77);

  const auto shown = report({"inspect", "dac", "--interval", "1ms"});
  const auto text = run({"inspect", "dac", "--last", "3", "--raw"}).out;

  ASSERT_THAT(shown, SizeIs(1));
  EXPECT_EQ(shown.at(0).at("kind"), "server window");
  EXPECT_EQ(shown.at(0).at("owner").at("pid"), ::getpid());
  EXPECT_EQ(shown.at(0).at("control").at("link_count"), 2);
  EXPECT_THAT(shown.at(0).at("hints").at("ready"), testing::Contains(300));
  EXPECT_THAT(shown.at(0).at("hints").at("knocks"), testing::Contains("77"));
  EXPECT_THAT(shown.at(0).at("links"), SizeIs(2));
  EXPECT_THAT(text, AllOf(HasSubstr("control: state open, sleeping "),
                          HasSubstr("waiting     #1 int32 "), HasSubstr("MPF-WIN1")));
  expectNarrow(text);
}

TEST_F(InspectTest, AWindowOrLinkIsFoundByItsFileToo) {
  connect(1);

  for (const auto& name : backplane_.segmentNames()) {
    if (name.find(".h.") != std::string::npos || name.find(".f.") != std::string::npos) continue;
    EXPECT_EQ(report({"inspect", name}).at(0).at("file"), segments::path(name));
    EXPECT_EQ(report({"inspect", segments::path(name)}).at(0).at("file"), segments::path(name));
  }
}

TEST_F(InspectTest, NamesWhatWasNotFound) {
  connect(1);

  const auto ended = run({"inspect", "dac", "adc"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out, HasSubstr("server window"));
  EXPECT_EQ(
      ended.err,
      "mpf inspect: no server, client, link or router \"adc\"; `mpf inspect --json` lists all of "
      "them\n");
}

TEST_F(InspectTest, ReadsALargeBodyFromItsChunkAndReportsAMissingPool) {
  connect(1);
  auto large = clients_.front()->alloc<Float64Array>(1000);
  large.value()[0] = 1.5;
  ASSERT_EQ(clients_.front()->send(std::move(large)), SendResult::sent);

  const auto link = theLink();
  copyAll();

  const auto& message = link.at("requests").at("messages").at(0);
  EXPECT_EQ(message.at("message").at("value").at(0), 1.5);
  EXPECT_THAT(link.at("client_pool").at("segments"), SizeIs(1));
  const auto file = folder_ / std::filesystem::path(link.at("file").get<std::string>()).filename();
  EXPECT_EQ(report({"inspect", "--file", file}).at(0).at("requests"), link.at("requests"))
      << "a copy shows the same";

  for (const auto& bulk : link.at("client_pool").at("segments")) {
    std::filesystem::remove(folder_ /
                            std::filesystem::path(bulk.at("file").get<std::string>()).filename());
  }
  const auto without =
      report({"inspect", "--file", file}).at(0).at("requests").at("messages").at(0);
  EXPECT_THAT(without.at("problem").get<std::string>(),
              testing::EndsWith(".0.0: the file does not exist"));
  expectNarrow(run({"inspect", "--file", file}).out);
}

TEST_F(InspectTest, NamesMissingAndTruncatedFiles) {
  connect(1);
  copyAll();
  const auto file =
      folder_ / std::filesystem::path(theLink().at("file").get<std::string>()).filename();
  std::ofstream(folder_ / "notes") << std::string(1000, 'x');

  EXPECT_EQ(run({"inspect", "--file", folder_ / "notes"}).err,
            "mpf inspect: " + (folder_ / "notes").string() +
                ": not a segment of MPF (wrong magic number)\n");
  EXPECT_EQ(run({"inspect", "--file", folder_ / "none"}).err,
            "mpf inspect: " + (folder_ / "none").string() + ": the file does not exist\n");
  for (const auto bytes : {0, 100, 511, 512, 3000, 6000}) {
    std::filesystem::resize_file(file, static_cast<std::uintmax_t>(std::max(bytes, 0)));
    const auto ended = run({"inspect", "--file", file});
    EXPECT_EQ(ended.status, 1);
    EXPECT_THAT(ended.err,
                HasSubstr(file.string() + ": truncated, " + std::to_string(bytes) + " bytes"));
    std::filesystem::copy_file(theLink().at("file").get<std::string>(), file,
                               std::filesystem::copy_options::overwrite_existing);
  }
}

// Any contents of a file give a result, never a signal.
TEST_F(InspectTest, SurvivesInvalidDataInFiles) {
  connect(1);
  for (int i = 0; i < 5; ++i)
    ASSERT_EQ(clients_.front()->send(clients_.front()->alloc<Float64Array>(100)), SendResult::sent);
  copyAll();
  Random random;
  std::vector<std::string> arguments{"inspect", "--raw", "--json"};
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    arguments.insert(arguments.end(), {"--file", entry.path()});
  }
  for (int round = 0; round < 25; ++round) {
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
      for (int i = 0; i < 30; ++i) {
        const auto place = i % 3 == 0
                               ? 16 + random.below(496)
                               : 512 + random.below(std::filesystem::file_size(entry.path()) - 512);
        file.seekp(static_cast<std::streamoff>(place));
        file.put(static_cast<char>(random.bits()));
      }
    }

    const auto ended = run(arguments);

    ASSERT_GE(ended.status, 0) << ended.err;
    ASSERT_LE(ended.status, 1) << ended.err;
    ASSERT_TRUE(nlohmann::json::accept(ended.out));
  }
}

TEST_F(InspectTest, ShowsWhatTwoDeadProcessesLeft) {
  Victim server("serve", backplane_.name());
  ASSERT_EQ(server.line(), "open");
  Victim flood("flood", backplane_.name());
  ASSERT_EQ(flood.line(), "connected");
  while (entryOf(ls().at("servers"), "name", "echo").at("received") == 0) continue;
  server.stop();
  flood.end(SIGKILL);
  server.end(SIGKILL);

  const auto link = theLink();

  EXPECT_EQ(link.at("waits"), "over: the client is dead");
  EXPECT_THAT(link.at("requests").at("messages"), testing::Not(IsEmpty()));
  static_cast<void>(backplane_.removeDead());
}

TEST_F(InspectTest, LimitsAThousandLinksToAPageInText) {
  constexpr int kClients = 1000;
  connect(kClients, 1);
  for (int i = 0; i < 100; ++i)
    ASSERT_EQ(clients_[static_cast<std::size_t>(i)]->send(Int32Message()), SendResult::sent);

  const auto text = run({"inspect"}).out;
  const auto all = summary();

  EXPECT_LE(std::ranges::count(text, '\n'), 80);
  EXPECT_THAT(text,
              AllOf(HasSubstr("  and 70 links more"), HasSubstr("  900 of 1000 links idle\n")));
  expectNarrow(text);
  EXPECT_THAT(all.at("links"), SizeIs(kClients));
  EXPECT_EQ(all.at("windows").at(0).at("waiting"), 100);
}

}  // namespace
}  // namespace mpf::test
