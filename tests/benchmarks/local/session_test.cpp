// SPDX-License-Identifier: MIT
#include "benchmarks/local/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::bench {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Measurement named(const std::string& setting, const std::string& name,
                  const std::string& floorName = {}) {
  Measurement row;
  row.setting = setting;
  row.question = setting;
  row.name = name;
  row.floorName = floorName;
  return row;
}

std::vector<std::string> fullNames(const std::vector<Measurement>& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) names.push_back(row.setting + "/" + row.name);
  return names;
}

TEST(Session, ChoosesTheNamedRowsAndTheirFloorsOfTheSameSetting) {
  Options options;
  options.only = {"near: ours"};

  const auto rows = choose(
      {named("near", "floor"), named("near", "ours", "floor"), named("near", "theirs", "floor"),
       named("far", "floor"), named("far", "ours", "floor")},
      options);

  EXPECT_THAT(fullNames(rows), ElementsAre("near/floor", "near/ours"));
}

TEST(Session, PlacesEachSideOnItsCpus) {
  const auto cpu = allowedCpus().front();
  Options options;
  options.cpus = {std::to_string(cpu), std::to_string(cpu) + "+" + std::to_string(cpu)};

  const auto placement = place(options, true);

  ASSERT_TRUE(placement);
  EXPECT_THAT(placement->server, ElementsAre(cpu));
  EXPECT_THAT(placement->requester, ElementsAre(cpu, cpu));
}

TEST(Session, RefusesInvalidCpus) {
  const auto cpu = std::to_string(allowedCpus().front());
  for (const std::string wrong : {"x", "", "-1", "0x", "9999", "+"}) {
    Options options;
    options.cpus = {cpu, wrong};

    EXPECT_FALSE(place(options, true)) << wrong;
  }
}

TEST(Session, RefusesOneCpuForBothSidesUnlessTheyMayShareIt) {
  const auto cpu = std::to_string(allowedCpus().front());
  Options options;
  options.cpus = {cpu, cpu};

  EXPECT_FALSE(place(options, false));
  EXPECT_TRUE(place(options, true));
}

TEST(Session, MeasuresAllRowsInOrder) {
  std::vector<Measurement> rows{named("a", "first"), named("b", "second")};
  for (auto& row : rows) {
    row.run = [](const Stage& stage) {
      Outcome outcome;
      outcome.figures.perSecond = static_cast<double>(stage.budget().measure.count());
      return outcome;
    };
  }
  Options quick;
  quick.quick = true;
  const Pace pace{std::chrono::seconds(1), std::chrono::milliseconds(500),
                  [](const Measurement&) { return 1; }};

  const auto full = takeAll(rows, {}, {}, pace);
  const auto shorter = takeAll(rows, {}, quick, pace);

  ASSERT_EQ(full.size(), 2u);
  EXPECT_EQ(full[1].measurement.name, "second");
  EXPECT_EQ(full[0].figures.perSecond, 0.8e9);
  EXPECT_EQ(shorter[0].figures.perSecond, 0.2e9);
}

TEST(Session, MeasuresTheRowsOfAQuestionAsABlock) {
  std::string order;
  const auto noting = [&](const std::string& question, const std::string& name) {
    auto row = named(question, name, "floor");
    row.run = [&order, name](const Stage&) {
      order += name;
      return Outcome{};
    };
    return row;
  };
  const Pace pace{std::chrono::seconds(1), std::chrono::seconds(1),
                  [](const Measurement&) { return 2; }, true};

  const auto results =
      takeAll({noting("one", "a"), noting("one", "b"), noting("two", "c")}, {}, {}, pace);

  EXPECT_EQ(order, "ababcc");
  EXPECT_EQ(results.size(), 3u);
}

}  // namespace
}  // namespace mpf::bench
