// SPDX-License-Identifier: MIT
#include "benchmarks/local/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "benchmarks/local/runner.h"

namespace mpf::bench {
namespace {

using testing::HasSubstr;

nlohmann::json parsed(const Result& result) {
  return nlohmann::json::parse(toJson({result}, Machine{}, {})).at(0);
}

// One row in earnest, however short: processes, loop, figures, JSON.
TEST(Json, HasWhatReadersCountOnForALatency) {
  const auto cpus = allowedCpus();
  const Placement placement{{cpus.front()}, {cpus.back()}};
  const auto rows = floorMeasurements();
  const Budget moment{std::chrono::milliseconds(1), std::chrono::milliseconds(4)};
  const auto asleep = std::find_if(rows.begin(), rows.end(),
                                   [](const auto& row) { return row.name == kFutexBounce; });

  const auto row = parsed(Runner(placement, rows).run({{*asleep, moment, 1}}).front());

  EXPECT_EQ(row.at("name"), kFutexBounce);
  EXPECT_EQ(row.at("mode"), "block");
  EXPECT_EQ(row.at("bytes"), 4);
  EXPECT_EQ(row.at("touched"), false);
  EXPECT_GT(row.at("p50_ns").get<double>(), 0);
  EXPECT_LE(row.at("p50_ns").get<double>(), row.at("p99_ns").get<double>());
  EXPECT_LE(row.at("p99_ns").get<double>(), row.at("p999_ns").get<double>());
  EXPECT_LE(row.at("p999_ns").get<double>(), row.at("max_ns").get<double>());
  EXPECT_GT(row.at("samples").get<int>(), 0);
  EXPECT_TRUE(row.at("floor_name").is_null());
  EXPECT_TRUE(row.at("ratio_to_floor").is_null());
  EXPECT_EQ(row.at("cpus").size(), 2u);
}

TEST(Json, HasWhatReadersCountOnForARate) {
  Result result;
  result.measurement.name = "MPF";
  result.measurement.mode = Mode::adaptive;
  result.measurement.floorName = "floor";
  result.figures.perSecond = 2e6;
  result.ratioToFloor = 3;

  const auto row = parsed(result);

  EXPECT_EQ(row.at("mode"), "adaptive");
  EXPECT_EQ(row.at("per_s"), 2e6);
  EXPECT_EQ(row.at("floor_name"), "floor");
  EXPECT_EQ(row.at("ratio_to_floor"), 3);
  EXPECT_FALSE(row.contains("p50_ns"));
}

TEST(Json, ShowsWhyRowsWereLeftOutOrFailed) {
  Result leftOut;
  leftOut.measurement.skipped = "not installed";
  Result failed;
  failed.error = "server died";

  EXPECT_EQ(parsed(leftOut).at("skipped"), "not installed");
  EXPECT_EQ(parsed(failed).at("error"), "server died");
}

TEST(Table, ShowsWhyRowsWereLeftOutOrFailed) {
  Result leftOut;
  leftOut.measurement.name = "ZeroMQ";
  leftOut.measurement.skipped = "not installed";
  Result failed;
  failed.measurement.name = "iceoryx";
  failed.error = "server died";

  const auto text = table({leftOut, failed});

  EXPECT_THAT(text, HasSubstr("ZeroMQ"));
  EXPECT_THAT(text, HasSubstr("left out: not installed"));
  EXPECT_THAT(text, HasSubstr("failed: server died"));
}

Result disturbed(double share) {
  Result result;
  result.measurement.name = "MPF";
  result.figures.perSecond = 2e6;
  result.disturbance.availableNs = 2e9;
  result.disturbance.takenNs = share * 2e9;
  result.disturbance.preemptions = 7;
  return result;
}

TEST(Json, SaysHowMuchARowWasDisturbed) {
  const auto row = parsed(disturbed(0.25));

  EXPECT_EQ(row.at("disturbed"), true);
  EXPECT_EQ(row.at("disturbed_percent"), 25);
  EXPECT_EQ(row.at("preemptions"), 7);
  EXPECT_EQ(parsed(disturbed(0.01)).at("disturbed"), false);
  EXPECT_FALSE(parsed(Result{}).contains("disturbed")) << "not measured";
}

TEST(Table, MarksRowsThatWereDisturbed) {
  auto moved = disturbed(0.01);
  moved.floorDrift = 2;
  auto far = disturbed(0.01);
  far.lineDrift = 4;
  far.haveLinesMoved = true;

  EXPECT_THAT(table({disturbed(0.25)}), HasSubstr("disturbed: others took 25 % of the CPUs"));
  EXPECT_THAT(table({moved}), HasSubstr("disturbed: floor moved x 2.00"));
  EXPECT_THAT(table({far}), HasSubstr("disturbed: cache lines moved x 4.00"));
  EXPECT_THAT(table({disturbed(0.01)}), testing::Not(HasSubstr("disturbed")));
}

TEST(Goals, AreShownOnlyForRowsThatWereTaken) { EXPECT_EQ(goals({}), ""); }

// A goal names its row; a row that is renamed must not lose it.
TEST(Goals, AreAllShownForAFullRun) {
  std::vector<Result> results;
  for (auto& row : catalogue("mpf-bench-test")) {
    Result result;
    result.measurement = std::move(row);
    result.measurement.skipped.clear();
    result.figures.perSecond = 1e6;
    result.ratioToFloor = 1;
    results.push_back(std::move(result));
  }

  const auto text = goals(results);

  constexpr std::ptrdiff_t kHead = 2;  // an empty line, and the titles
  EXPECT_EQ(std::ranges::count(text, '\n'), kHead + 15) << text;
}

}  // namespace
}  // namespace mpf::bench
