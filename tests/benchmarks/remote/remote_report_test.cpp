// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "benchmarks/local/report.h"
#include "benchmarks/remote/remote.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;
using testing::Not;

// The result of a row with a message rate, and the ratio of that rate to raw TCP's.
Result taken(const std::string& question, const std::string& name, std::size_t bytes,
             double perSecond, double timesTcp) {
  Result result;
  result.measurement.setting = "loopback";
  result.measurement.question = kLoopback + question;
  result.measurement.name = name;
  result.measurement.bytes = bytes;
  result.measurement.floorName = "raw TCP, of a kind";
  result.figures.perSecond = perSecond;
  result.figures.latency.add(1000);
  result.floorNs = 1e9 / perSecond * timesTcp;
  result.ratioToFloor = 1 / timesTcp;
  return result;
}

Result messages(const std::string& buffer, double timesTcp) {
  return taken(kMessages, "MPF remote, " + buffer, 4, 20e3, timesTcp);
}
Result arrays(double gibPerSecond, double timesTcp) {
  return taken(kArrays, "MPF remote, Float64Array, one at a time", 1u << 20, gibPerSecond * 1024,
               timesTcp);
}

TEST(RemoteTable, ShowsTheRatioToRawTcp) {
  auto row = messages("no buffer", 0.5);
  row.figures.writesPerSecond = 19.9e3;
  row.figures.idleRequester = 0.25;
  row.figures.idleServer = 0.5;

  const auto text = remoteTable({row});

  EXPECT_THAT(text, HasSubstr("One host, loopback: round trips of an Int32\n"));
  EXPECT_THAT(text, HasSubstr("20.0 k/s   19.9 k/s    25 %    50 %"));
  EXPECT_THAT(text, HasSubstr(" 0.50  40.0 k/s: raw TCP, of a kind\n"));
}

TEST(RemoteTable, ShowsBytesPerSecondOfLargeMessages) {
  const auto text = remoteTable({arrays(1.5, 0.75)});

  EXPECT_THAT(text, HasSubstr(" 1.50 GiB/s "));
  EXPECT_THAT(text, HasSubstr(" 0.75  2.00 GiB/s: raw TCP, of a kind\n"));
}

TEST(RemoteTable, ShowsWhyRowsWereLeftOutOrFailed) {
  auto leftOut = messages("100 buffered", 1);
  leftOut.measurement.skipped = "mpf-router does not exist";
  auto failed = messages("1000 buffered", 1);
  failed.error = "the client's router has ended: bad luck";

  const auto text = remoteTable({leftOut, failed});

  EXPECT_THAT(text, HasSubstr("left out: mpf-router does not exist"));
  EXPECT_THAT(text, HasSubstr("failed: the client's router has ended: bad luck"));
}

TEST(RemoteGoals, AreShownOnlyForRowsThatWereTaken) {
  EXPECT_EQ(remoteGoals({}), "");
  EXPECT_THAT(remoteGoals({messages("no buffer", 0.5)}), Not(HasSubstr("100 buffered")));
}

TEST(RemoteGoals, RequireAShareOfRawTcpAndAMessageRate) {
  EXPECT_THAT(remoteGoals({messages("no buffer", 0.81)}), HasSubstr("0.80      0.81  reached"));
  EXPECT_THAT(remoteGoals({messages("no buffer", 0.79)}), HasSubstr("0.80      0.79  MISSED"));
  EXPECT_THAT(remoteGoals({messages("100 buffered", 0.61)}), HasSubstr("0.60      0.61  reached"));
  EXPECT_THAT(remoteGoals({messages("100 buffered", 0.59)}), HasSubstr("0.60      0.59  MISSED"));
  auto many = messages("1000 buffered", 0.1);
  EXPECT_THAT(remoteGoals({many}), HasSubstr("2.00      0.02  MISSED"));
  many.figures.perSecond = 2.01e6;
  EXPECT_THAT(remoteGoals({many}), HasSubstr("2.00      2.01  reached"));
}

TEST(RemoteGoals, RequireAGibibytePerSecondOrFourFifthsOfRawTcp) {
  EXPECT_THAT(remoteGoals({arrays(1.1, 0.3)}), HasSubstr("1.00      1.10  reached"))
      << "1 GiB/s reaches the goal";
  EXPECT_THAT(remoteGoals({arrays(0.9, 0.9)}), HasSubstr("0.80      0.90  reached"))
      << "80 % of raw TCP reaches the goal";
  EXPECT_THAT(remoteGoals({arrays(0.9, 0.5)}), HasSubstr("1.00      0.90  MISSED"));
}

TEST(RemoteJson, HasTheDocumentedFields) {
  auto row = messages("no buffer", 0.5);
  row.figures.writesPerSecond = 19.9e3;
  row.figures.idleRequester = 0.25;
  row.figures.idleServer = 0.5;

  const auto object = nlohmann::json::parse(toJson({row}, Machine{}, {{0, 2}, {1}})).at(0);

  EXPECT_EQ(object.at("setting"), "loopback");
  EXPECT_EQ(object.at("per_s"), 20e3);
  EXPECT_EQ(object.at("writes_per_s"), 19.9e3);
  EXPECT_EQ(object.at("idle_client_percent"), 25);
  EXPECT_EQ(object.at("idle_server_percent"), 50);
  EXPECT_EQ(object.at("ratio_to_floor"), 2);
  EXPECT_TRUE(object.contains("p50_ns") && object.contains("p99_ns") &&
              object.contains("p999_ns") && object.contains("max_ns"));
  EXPECT_EQ(object.at("cpus").size(), 3u);
}

}  // namespace
}  // namespace mpf::bench
