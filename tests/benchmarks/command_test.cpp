// SPDX-License-Identifier: MIT
// The program `mpf bench`. These tests check no speed.
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/tools/tool.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Ended bench(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "bench");
  return runTool(std::move(arguments), {});
}

TEST(BenchCommand, HelpNamesAllBenches) {
  const auto ended = bench({"--help"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.out, AllOf(HasSubstr("local"), HasSubstr("remote"), HasSubstr("hardware"),
                               HasSubstr("epics")));
}

TEST(BenchCommand, ListsTheManualsTableAtBothPlaces) {
  const auto ended = bench({"remote", "--list"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  for (const auto* place : {"One host, loopback", "Two network namespaces, veth"}) {
    for (const auto* row :
         {"raw TCP, no buffer", "raw TCP, 100 in one write", "MPF remote, no buffer",
          "MPF remote, 100 buffered", "MPF remote, 1000 buffered"})
      EXPECT_THAT(ended.out,
                  HasSubstr(std::string(place) + ": round trips of an Int32: " + row + ","));
  }
  EXPECT_THAT(ended.out,
              AllOf(HasSubstr("MPF local, no buffer"), HasSubstr("MPF local, 1000 buffered")));
}

TEST(BenchCommand, MeasuresOnLoopback) {
  const auto ended = bench({"remote", "--quick", "--json", "-", "--only",
                            "loopback: round trips of an Int32: raw TCP, no buffer", "--only",
                            "MPF local, 100 buffered"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 3u);  // and the floor of the second
  EXPECT_EQ(rows[0].at("name"), "raw TCP, no buffer");
  EXPECT_GT(rows[0].at("per_s").get<double>(), 0);
  EXPECT_GT(rows[0].at("writes_per_s").get<double>(), 0);
  EXPECT_EQ(rows[1].at("name"), "raw TCP, 100 in one write");
  EXPECT_EQ(rows[1].at("bytes"), 4);
  EXPECT_EQ(rows[2].at("floor_name"), "raw TCP, 100 in one write");
  EXPECT_GT(rows[2].at("ratio_to_floor").get<double>(), 0);
}

TEST(BenchCommand, LeavesOutNamespacesForAUserWhoMayNotCreateThem) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  constexpr uid_t kNobody = 65534;

  const auto ended =
      Tool({"bench", "remote", "--list", "--only", "veth: round trips of an Int32: raw TCP"}, {},
           kNobody)
          .end();

  EXPECT_EQ(ended.status, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("(left out: unshare"));
}

TEST(BenchCommand, ListsEachServerOverHardware) {
  const auto ended = bench({"hardware", "--list"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  for (const auto* program : {"mpf-int32-server", "mpf-dac128v-server", "mpf-ip330-server",
                              "mpf-digital-io-server", "mpf-serial-server"})
    EXPECT_THAT(ended.out,
                HasSubstr(std::string("Round trips with a server over a model: ") + program));
  EXPECT_THAT(ended.out, AllOf(HasSubstr("the driver's thread"), HasSubstr("the manual's, local")));
}

TEST(BenchCommand, ListsEachPeerInstalledOrNot) {
  const auto ended = bench({"local", "--list"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  for (const auto* peer : {"MPF", "Boost message_queue", "Unix socket", "ZeroMQ", "iceoryx 2.0",
                           "iceoryx2", "iceoryx2 pub-sub", "Aeron (Java)", "Aeron (C)"})
    EXPECT_THAT(ended.out, HasSubstr(std::string("Round trip of 4 B: ") + peer + ","));
}

TEST(BenchCommand, ListsRowsWithoutCheckingTheCpus) {
  for (const auto* const which : {"local", "remote", "hardware", "epics"})
    EXPECT_EQ(bench({which, "--list", "--cpus", "0,9999"}).status, 0) << which;
}

TEST(BenchCommand, MarksTheManualsFiguresAsNotMeasured) {
  const auto ended = bench({"hardware", "--json", "-", "--only", "the manual's, remote"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("per_s"), 156);
  EXPECT_EQ(rows[1].at("value"), 91);
  EXPECT_EQ(rows[1].at("unit"), "% of one CPU");
  for (const auto& row : rows) EXPECT_EQ(row.at("detail"), "not measured here");
}

TEST(BenchCommand, MeasuresAServerOverAModelBesideTheEcho) {
  const auto ended = bench({"hardware", "--quick", "--json", "-", "--only", "mpf-dac128v-server"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 2u);  // and its floor
  EXPECT_EQ(rows[0].at("name"), "mpf-int32-server, the echo");
  EXPECT_GT(rows[0].at("per_s").get<double>(), 0);
  EXPECT_EQ(rows[1].at("floor_name"), rows[0].at("name"));
  EXPECT_GT(rows[1].at("ratio_to_floor").get<double>(), 0);
  EXPECT_GT(rows[1].at("p99_ns").get<double>(), 0);
}

TEST(BenchCommand, MeasuresRecordsOfAnIoc) {
  const auto ended =
      bench({"epics", "--quick", "--json", "-", "--only", "1 record", "--only", "one value"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 3u);  // with the floor
  if (rows[1].contains("skipped")) GTEST_SKIP() << rows[1].at("skipped");
  EXPECT_EQ(rows[1].at("name"), "1 record at a time");
  EXPECT_GT(rows[1].at("per_s").get<double>(), 0);
  EXPECT_EQ(rows[1].at("floor_name"), "SyncClient, no record");
  EXPECT_GT(rows[2].at("p99_ns").get<double>(), 0);
}

TEST(BenchCommand, MeasuresEightSerialPortsBesideTheManual) {
  const auto ended =
      bench({"hardware", "--quick", "--json", "-", "--only", "echo read, no line time"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0].at("per_s"), 159);
  EXPECT_GT(rows[1].at("per_s").get<double>(), 0);
  EXPECT_GT(rows[1].at("ratio_to_floor").get<double>(), 0);
  EXPECT_EQ(rows[2].at("unit"), "% of one CPU");
  EXPECT_EQ(rows[3].at("unit"), "answers");
}

TEST(BenchCommand, MeasuresAModelThatScans) {
  const auto ended = bench(
      {"hardware", "--quick", "--json", "-", "--only", "scans read", "--only", "driver's thread"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto rows = nlohmann::json::parse(ended.out);
  ASSERT_EQ(rows.size(), 2u);
  for (const auto& row : rows) EXPECT_GT(row.at("value").get<double>(), 0) << row.at("name");
}

TEST(BenchCommand, RefusesWrongArguments) {
  EXPECT_EQ(bench({"remote", "--only", "no such row"}).status, 2);
  EXPECT_EQ(bench({"remote", "--cpus", "0,none"}).status, 2);
  EXPECT_THAT(bench({"remote", "--wait", "long"}).err, HasSubstr("--wait"));
  const auto spinning = bench({"hardware", "--list", "--wait", "spin"});
  EXPECT_EQ(spinning.status, 2);
  EXPECT_THAT(spinning.err, HasSubstr("share a CPU"));
}

}  // namespace
}  // namespace mpf::test
