// SPDX-License-Identifier: MIT
// Statistics: the rows of the segment that tools read.
#include "router/statistics.h"

#include <gtest/gtest.h>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/support/test_backplane.h"

namespace mpf::router::test {
namespace {

using State = layout::RouterLineState;

std::string textOf(const auto& chars) { return chars.data(); }

TEST(PeerRecord, WritesTextsAndCutsLongOnes) {
  layout::RouterLine row{};
  PeerRecord record(row);

  record.setAddress("ioc1.lab:9900");
  record.setPeer("ioc1", std::string(1000, 'x'));
  record.setLocations({1, -2, 3});
  record.setProblem("no route");

  EXPECT_EQ(textOf(row.address), "ioc1.lab:9900");
  EXPECT_EQ(textOf(row.peer), "ioc1");
  EXPECT_EQ(textOf(row.program), std::string(row.program.size() - 1, 'x'));
  EXPECT_EQ(textOf(row.locations), "1, -2, 3");
  EXPECT_EQ(textOf(row.problem), "no route");
  EXPECT_EQ(row.texts % 2, 0u) << "no change is in progress";
}

TEST(PeerRecord, AShorterTextLeavesNothingOfTheLongerOne) {
  layout::RouterLine row{};
  PeerRecord record(row);
  record.setProblem("a long reason");

  record.setProblem("short");

  EXPECT_EQ(std::string(row.problem.begin(), row.problem.end()),
            "short" + std::string(row.problem.size() - 5, '\0'));
}

// sinceNs is the time since which the line is connected, or is not connected.
TEST(PeerRecord, TheTimeDoesNotChangeBetweenWaitingAndConnecting) {
  layout::RouterLine row{};
  PeerRecord record(row);
  record.setState(State::waiting);
  row.sinceNs = 1;

  record.setState(State::connecting);
  record.setState(State::waiting);
  EXPECT_EQ(row.sinceNs, 1u);

  record.setState(State::connected);
  EXPECT_GT(row.sinceNs, 1u);
}

TEST(Statistics, RowsAreFreeAgainWhenTheirRecordIsGone) {
  const mpf::test::TestBackplane backplane;
  Statistics statistics(backplane, "test");
  auto record = statistics.add(layout::RouterRole::server);
  auto& row = *record->operator->();
  EXPECT_EQ(row.role, layout::RouterRole::server);
  EXPECT_EQ(row.state, State::waiting);
  row.messagesSent = 5;

  record.reset();
  EXPECT_EQ(row.role, layout::RouterRole::none);
  EXPECT_EQ(row.messagesSent, 0u);

  record = statistics.add(layout::RouterRole::client);
  EXPECT_EQ(record->operator->(), &row);
}

TEST(Statistics, FurtherConnectionsCountInMemoryOfTheProcess) {
  const mpf::test::TestBackplane backplane;
  Statistics statistics(backplane, "test");
  std::vector<std::shared_ptr<PeerRecord>> records;
  std::set<layout::RouterLine*> rows;

  for (std::uint32_t i = 0; i < layout::kRouterLines + 2; ++i) {
    records.push_back(statistics.add(layout::RouterRole::client));
    rows.insert(records.back()->operator->());
    (*records.back())->messagesSent = i;
  }

  EXPECT_EQ(rows.size(), records.size());
  for (std::uint32_t i = 0; i < records.size(); ++i) EXPECT_EQ((*records[i])->messagesSent, i);
}

}  // namespace
}  // namespace mpf::router::test
