// SPDX-License-Identifier: MIT
#include "client/request_table.h"

#include <array>
#include <atomic>
#include <gtest/gtest.h>
#include <set>
#include <thread>
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

// A table that has grown from 4 to 16 entries while requests are in it.
class GrownTable : public testing::Test {
 protected:
  GrownTable() {
    for (int i = 0; i < 4; ++i) early_.push_back(&addNew(table_));
    EXPECT_EQ(table_.tryReserve(none_), nullptr);
    EXPECT_TRUE(table_.tryGrow(12));
  }
  RequestTable table_{4};
  std::vector<Request*> early_;
  std::uint32_t none_ = 0;
};

TEST_F(GrownTable, HasTheRequestsOfBeforeAndNewOnes) {
  std::vector<Request*> all = early_;
  for (int i = 0; i < 8; ++i) all.push_back(&addNew(table_));

  EXPECT_EQ(table_.tryReserve(none_), nullptr);
  EXPECT_EQ(table_.outstanding(), 12U);
  for (int i = 0; i < 2; ++i) {  // the second time, it looks into the second table first
    for (auto* request : all) EXPECT_EQ(table_.find(request->id.load()), request);
  }
  int visited = 0;
  table_.forEach([&](Request&) { ++visited; });
  EXPECT_EQ(visited, 12);
  for (auto* request : all) table_.end(*request);
  EXPECT_EQ(table_.outstanding(), 0U);
}

// The server identifies requests by their places among 16.
TEST_F(GrownTable, NoTwoRequestsHaveTheSamePlace) {
  const auto kept = early_[1]->id.load();
  for (int i : {0, 2, 3}) table_.end(*early_[static_cast<std::size_t>(i)]);

  for (int i = 0; i < 1000; ++i) {
    auto& request = addNew(table_);
    ASSERT_NE(request.id.load() % 16, kept % 16);
    table_.end(request);
    ASSERT_EQ(table_.find(kept), early_[1]);
  }
  std::uint32_t samePlace = kept + 16;
  EXPECT_EQ(table_.tryReserve(samePlace), nullptr);
  table_.end(*early_[1]);
  EXPECT_NE(table_.tryReserve(samePlace), nullptr);
  std::set<std::uint32_t> places;
  for (int i = 0; i < 16; ++i) {
    auto& request = addNew(table_);
    places.insert(request.id.load() % 16);
    table_.end(request);
  }
  EXPECT_EQ(places.size(), 16U) << "no place is lost";
}

// The dispatcher's thread looks requests up while another thread makes the table grow. An id whose
// place is still in use is skipped.
TEST(RequestTable, GrowsWhileRequestsEnd) {
  for (int round = 0; round < 200; ++round) {
    RequestTable table(4);
    std::array<std::atomic<std::uint32_t>, 100> ids{};
    std::uint32_t wrong = 0;
    std::thread dispatcher([&] {
      for (auto& each : ids) {
        while (each.load() == 0) std::this_thread::yield();
        auto* request = table.find(each.load());
        if (request == nullptr || request->clientType != static_cast<std::int32_t>(each.load()))
          ++wrong;
        if (request != nullptr) table.end(*request);
      }
    });
    bool isAllowed = true;
    for (std::size_t sent = 0; sent < ids.size();) {
      std::uint32_t id = 0;
      auto* request = table.tryReserve(id);
      if (request == nullptr) {
        if (sent > 20) isAllowed = table.tryGrow(64) && isAllowed;
        std::this_thread::yield();
        continue;
      }
      request->clientType = static_cast<std::int32_t>(id);
      table.add(*request, id);
      ids[sent++].store(id);
    }
    dispatcher.join();
    ASSERT_EQ(wrong, 0U);
    ASSERT_TRUE(isAllowed);
    ASSERT_EQ(table.outstanding(), 0U);
  }
}

}  // namespace
}  // namespace mpf::test
