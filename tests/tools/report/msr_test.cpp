// SPDX-License-Identifier: MIT
// msr: a server's queue, requests, fates, latencies and clients.
#include <filesystem>
#include <fstream>

#include "shm/segment_name.h"
#include "tests/tools/report/report_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

// The lines of the example in the manual, "Diagnostic Aids", with the numbers of this test.
TEST_F(ReportTest, MsrBeginsWithTheLinesOfTheManual) {
  openServer("serial[7]", 2);
  connect();
  ASSERT_EQ(send(), SendResult::sent);
  handle(1);
  ASSERT_EQ(send(), SendResult::sent);
  ASSERT_EQ(send(), SendResult::sent);
  ASSERT_EQ(send(), SendResult::queueFull);

  const auto ended = run({"msr", "serial[7]"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.out, StartsWith("serial[7]\n"
                                    "          queueSize 2\n"
                                    "            inQueue 2\n"
                                    "      queueRequests 1\n"
                                    " queueFullResponses 1\n"
                                    "      replyRequests 1\n"
                                    "              state stalled, pid "));
  EXPECT_THAT(ended.out,
              testing::ContainsRegex(
                  "  client +state +inQueue +open +requests +replies +notTaken +refused +bytes\n"
                  "  tools_test\\[[0-9]+\\]\n? +[a-z]+ +2 +3 +3 +1 +1 +1 +[0-9]+\n"));
}

TEST_F(ReportTest, MsrReportsAllServersOrANamedOne) {
  openServer("one");
  const MessageServer two(backplane_, "two");

  EXPECT_THAT(report({"msr"}), SizeIs(2));
  const auto named = report({"msr", "two"});
  ASSERT_THAT(named, SizeIs(1));
  EXPECT_EQ(named.at(0).at("name"), "two");
  EXPECT_EQ(named.at(0).at("backplane"), backplane_.name());
}

TEST_F(ReportTest, MsrNamesAnAbsentServer) {
  const auto ended = run({"msr", "serial[7]"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err, "mpf msr: no server \"serial[7]\"; `mpf ls` lists the servers\n");
}

TEST_F(ReportTest, MsrSelectsAServerByLocation) {
  const MessageServer here(backplane_, "dac", {.location = 0});
  const MessageServer there(backplane_, "dac", {.location = 2});

  const auto named = report({"msr", "dac", "--location", "2"});
  ASSERT_THAT(named, SizeIs(1));
  EXPECT_EQ(named.at(0).at("location"), 2);
  EXPECT_EQ(run({"msr", "dac", "--location", "3"}).err,
            "mpf msr: no server \"dac\" at location 3; `mpf ls` lists the servers\n");
}

// A file that cannot be read is reported; it may be the server that was asked for.
TEST_F(ReportTest, MsrReportsFilesThatItCannotRead) {
  const auto file = segments::path(SegmentName::serverWindow(backplane_.name(), 0, "dac"));
  std::ofstream(file) << "x";

  const auto all = run({"msr"});
  const auto named = run({"msr", "dac"});
  const MessageServer other(backplane_, "other");
  const auto some = run({"msr"});
  const auto forPrograms = run({"msr", "--json"});
  std::filesystem::remove(file);

  EXPECT_EQ(all.status, 1);
  EXPECT_THAT(all.err,
              HasSubstr("mpf msr: " + file + ": truncated, 1 bytes are too few for a header\n"));
  EXPECT_EQ(all.out, "no server, unless it is in a file that could not be read\n");
  EXPECT_EQ(named.status, 1);
  EXPECT_THAT(named.err,
              HasSubstr("no server \"dac\", unless it is in a file that could not be read; "
                        "`mpf ls` lists the servers\n"));
  EXPECT_EQ(some.status, 0);
  EXPECT_THAT(inOneLine(some.out),
              HasSubstr("1 file could not be read: servers may be missing here problem: " + file +
                        ": truncated"));
  EXPECT_THAT(forPrograms.err,
              testing::StartsWith(
                  "mpf msr: 1 file could not be read: servers may be missing here\nmpf msr: " +
                  file + ":"));
  EXPECT_EQ(nlohmann::json::parse(forPrograms.out).size(), 1U);
}

// Shows the histograms of a server as a sparkline and as percentiles, in text and in JSON.
TEST_F(ReportTest, MsrShowsLatencies) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo", 0);
  const auto isSampled = [&] {
    return report({"msr", "echo"}).at(0).at("service").at("count").get<int>() != 0;
  };
  while (!isSampled()) {
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(client.call(Int32Message(), 60s));
  }

  const auto text = run({"msr", "echo"}).out;
  const auto service = report({"msr", "echo"}).at(0).at("service");

  EXPECT_THAT(
      inOneLine(text),
      testing::ContainsRegex(
          " service p50 [0-9.]+ [mun]?s, p99 [0-9.]+ [mun]?s, p99.9 [0-9.]+ [mun]?s, max "));
  EXPECT_LE(service.at("p50_ns"), service.at("p99_ns"));
  EXPECT_LE(service.at("p999_ns"), service.at("max_ns"));
}

}  // namespace
}  // namespace mpf::test
