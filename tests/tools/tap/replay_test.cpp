// SPDX-License-Identifier: MIT
// `mpf replay`: sends recordings again, and reports what became of the requests.
#include <sys/stat.h>

#include <atomic>
#include <filesystem>

#include "tests/tools/tap/tap_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ReplayTest : public TapTest {
 protected:
  // A recording of these requests of one client to "echo", which has ended then.
  void record(int requests) {
    const EchoThread echo(backplane_, "echo");
    SyncClient client(backplane_, "echo");
    callMany(client, 0, 1);
    const auto tool = tap({"--write", file_, "--count", std::to_string(2 * requests)});
    callMany(client, 0, requests);
    EXPECT_EQ(tool->end().status, 0);
  }
};

TEST_F(ReplayTest, SendsARecordingInOrder) {
  {
    const EchoThread echo(backplane_, "echo");
    SyncClient one(backplane_, "echo");
    SyncClient two(backplane_, "echo");
    callMany(one, 0, 1);
    callMany(two, 0, 1);
    const auto tool = tap({"--write", file_, "--count", "44"}, 2);
    for (int i = 0; i < 10; ++i) {
      callMany(one, i, i + 1);
      callMany(two, 100 + i, 101 + i);
    }
    auto array = Int32ArrayMessage::allocValue(1000);
    std::ranges::fill(array.value(), 7);
    ASSERT_TRUE(one.call(std::move(array), 1h));
    ASSERT_TRUE(two.call(Char8ArrayMessage::allocValue(0), 1h));
    EXPECT_EQ(tool->end().status, 0);
  }
  std::vector<std::int32_t> values;
  std::size_t elements = 0;
  MessageServer server(backplane_, "echo");
  server.on<Int32>([&](Int32& request) { values.push_back(request.value); });
  server.on<Int32Array>([&](Int32ArrayMessage& request) { elements += request.value().size(); });
  server.on<Char8Array>([](Char8ArrayMessage&) {});
  std::thread thread([&] { server.run(); });

  const auto ended = run({"replay", file_, "--timeout", "1000", "--json"});

  server.interrupt();
  thread.join();
  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_EQ(report.at("clients"), 2);
  EXPECT_EQ(report.at("requests"), 22);
  EXPECT_EQ(report.at("replied"), 22);
  EXPECT_THAT(report.at("ends"), IsEmpty());
  std::vector<std::int32_t> ofOne;
  std::ranges::copy_if(values, std::back_inserter(ofOne), [](auto value) { return value < 100; });
  EXPECT_THAT(ofOne, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_EQ(values.size(), 20u);
  EXPECT_EQ(elements, 1000u);
}

TEST_F(ReplayTest, RefusesAFileThatIsNotARecording) {
  std::ofstream(file_) << "a text that is not a recording, but long enough for frame headers: ";

  const auto ended = run({"replay", file_});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err, "mpf replay: " + file_ +
                           ": record 1, at byte 0 of 67: not a recording of `mpf tap "
                           "--write`, or one that was cut off within its "
                           "first record\n");
  EXPECT_EQ(ended.out, "") << "no request was sent";
  EXPECT_EQ(run({"replay", file_ + ".none"}).status, 2);
}

TEST_F(ReplayTest, SendsATruncatedRecordingUpToItsEnd) {
  record(2);
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 5);
  const EchoThread echo(backplane_, "echo");

  const auto ended = run({"replay", file_, "--speed", "0", "--timeout", "1000"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out, HasSubstr("2 requests of 1 client to \"echo\": 2 replied"));
  EXPECT_THAT(ended.err,
              testing::MatchesRegex("mpf replay: .*: record 5, at byte [0-9]+ of [0-9]+: the file "
                                    "is damaged, or was cut off here; the "
                                    "records before it can be read: `head -c [0-9]+ FILE >NEW` "
                                    "keeps them, `mpf tap --write` records "
                                    "again\n"));
}

// The requests go to the server that the user names, as the one of the recording may not run here.
TEST_F(ReplayTest, SendsToAnotherServerAndReportsWhatIsNotAnswered) {
  record(2);
  MessageServer other(backplane_, "other", {.location = 3});
  other.on<Float64>([](Float64&) {});
  std::thread thread([&] { other.run(); });

  const auto ended = run({"replay", file_, "--server", "other", "--location", "3", "--speed", "0",
                          "--timeout", "1000"});

  other.interrupt();
  thread.join();
  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.out, "2 requests of 1 client to \"other\": 0 replied, 2 refused\n");
}

// The further replies of one request do not count as replies to another.
TEST_F(ReplayTest, ARequestWithoutAReplyIsAnErrorAlsoBesideASubscription) {
  record(2);
  MessageServer server(backplane_, "echo");
  std::vector<Int32Message> kept;
  std::atomic<int> taken{0};
  server.on<Int32>([&](Int32Message&& request) {
    kept.push_back(std::move(request));
    const std::vector<Int32> replies(3);
    if (kept.size() == 1) server.replyMany<Int32>(kept.front(), replies);
    ++taken;
  });
  std::thread thread([&] { server.run(); });

  Tool tool({"replay", file_, "--speed", "0", "--timeout", "1000", "--json"}, backplane_.name());
  while (taken < 2) std::this_thread::yield();
  tool.signal(SIGINT);
  const auto ended = tool.end();

  server.interrupt();
  thread.join();
  EXPECT_EQ(ended.status, 1);
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_LE(report.at("replied"), 1);
  EXPECT_TRUE(report.at("ends").contains("no reply yet")) << ended.out;
}

TEST_F(ReplayTest, NamesAFileThatIsNotARegularFile) {
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);

  const auto ended = run({"replay", file_});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr(file_ + ": not a regular file; name a recording"));
}

TEST_F(ReplayTest, ARecordingWithoutARequestIsAnError) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--write", file_});
  tool->signal(SIGINT);
  EXPECT_EQ(tool->end().status, 0);

  const auto ended = run({"replay", file_});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err, "mpf replay: " + file_ + ": no request in it\n");
  EXPECT_EQ(ended.out, "");
}

TEST_F(ReplayTest, CtrlCEndsItWhileTheServerDoesNotAcceptIt) {
  record(1);
  MessageServer server(backplane_, "echo");
  Tool tool({"replay", file_, "--timeout", "100000"}, backplane_.name());
  while (!server.waitForMessage()) continue;  // it asks for a connection

  tool.signal(SIGINT);

  const auto ended = tool.end();
  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("mpf replay: "));
  EXPECT_THAT(ended.err, HasSubstr("\"echo\""));
}

TEST_F(ReplayTest, NamesAnAbsentServer) {
  record(1);

  const auto ended = run({"replay", file_, "--timeout", "0.01"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("\"echo\""));
  EXPECT_THAT(ended.err, HasSubstr("; `mpf ls` shows all servers\n"));
}

}  // namespace
}  // namespace mpf::test
