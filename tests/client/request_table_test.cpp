// SPDX-License-Identifier: MIT
#include "client/request_table.h"

#include <gtest/gtest.h>
#include <vector>

namespace mpf::test {
namespace {

Request& addNew(RequestTable& table) {
  std::uint32_t id = 0;
  auto* request = table.tryReserve(id);
  table.add(*request, id);
  return *request;
}

TEST(RequestTable, FindsARequestUntilItEnds) {
  RequestTable table(4);
  auto& request = addNew(table);
  const auto id = request.id.load();
  EXPECT_EQ(table.find(id), &request);
  EXPECT_EQ(table.outstanding(), 1U);

  table.end(request);

  EXPECT_EQ(table.find(id), nullptr);
  EXPECT_EQ(table.outstanding(), 0U);
}

TEST(RequestTable, RefusesMoreThanTheMaximum) {
  RequestTable table(3);  // the table has four entries
  for (int i = 0; i < 3; ++i) addNew(table);

  std::uint32_t id = 0;
  EXPECT_EQ(table.tryReserve(id), nullptr);
}

TEST(RequestTable, SkipsPlacesThatAreInUse) {
  RequestTable table(4);
  auto& first = addNew(table);
  for (int i = 0; i < 3; ++i) table.end(addNew(table));

  auto& next = addNew(table);

  EXPECT_NE(&next, &first);
  EXPECT_EQ(table.find(first.id.load()), &first);
}

TEST(RequestTable, RefusesAChosenIdWhosePlaceIsInUse) {
  RequestTable table(4);
  std::uint32_t id = 5;
  table.add(*table.tryReserve(id), id);

  std::uint32_t samePlace = 9;
  std::uint32_t otherPlace = 6;

  EXPECT_EQ(table.tryReserve(samePlace), nullptr);
  EXPECT_NE(table.tryReserve(otherPlace), nullptr);
}

TEST(RequestTable, ContinuesTheIdsOfTheLastConnection) {
  RequestTable first(4);
  const auto id = addNew(first).id.load();

  RequestTable second(4, first.lastId());

  EXPECT_EQ(addNew(second).id.load(), id + 1);
}

TEST(RequestTable, NeverUsesTheIdZero) {
  RequestTable table(4, UINT32_MAX);

  EXPECT_EQ(addNew(table).id.load(), 1U);
}

TEST(RequestTable, AGivenUpRequestKeepsItsPlaceButIsNotAwaited) {
  RequestTable table(1);
  auto& request = addNew(table);

  table.giveUp(request);

  EXPECT_EQ(table.awaited(), 0U);
  EXPECT_EQ(table.outstanding(), 1U);
  std::uint32_t id = 0;
  EXPECT_EQ(table.tryReserve(id), nullptr);
  table.end(request);
  EXPECT_FALSE(addNew(table).isGivenUp);
  EXPECT_EQ(table.awaited(), 1U);
}

TEST(RequestTable, ARequestThatWasTakenBackIsNotOutstanding) {
  RequestTable table(1);
  auto& request = addNew(table);

  table.takeBack(request);

  EXPECT_EQ(table.outstanding(), 0U);
  table.forEach([](Request&) { FAIL(); });
}

TEST(RequestTable, VisitsTheOutstandingRequests) {
  RequestTable table(4);
  addNew(table);
  table.end(addNew(table));
  addNew(table);

  std::vector<std::uint32_t> ids;
  table.forEach([&](Request& request) { ids.push_back(request.id.load()); });

  EXPECT_EQ(ids, (std::vector<std::uint32_t>{1, 3}));
}

}  // namespace
}  // namespace mpf::test
