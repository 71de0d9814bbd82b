// SPDX-License-Identifier: MIT
// NameWatch: names that appear in /dev/shm. Other programs create names there, too.
#include "tools/tap/name_watch.h"

#include <algorithm>

#include "tests/shm/shm_fixture.h"

namespace mpf::tools {
namespace {

using namespace std::chrono_literals;
using test::ShmTest;

class NameWatchTest : public ShmTest {
 protected:
  void publish(const std::string& segment) const { ASSERT_TRUE(createPage().tryPublish(segment)); }
  // Whether `segment` is one of the names that have appeared.
  bool hasAppeared(const std::string& segment) {
    const auto names = watch_.take();
    return names && std::ranges::find(*names, segment) != names->end();
  }

  const std::string first_ = serverName("first");
  const std::string second_ = serverName("second");
  NameWatch watch_;
};

TEST_F(NameWatchTest, ReportsEachNewNameOnce) {
  EXPECT_FALSE(hasAppeared(first_));
  publish(first_);
  publish(second_);

  const auto names = watch_.take();

  ASSERT_TRUE(names);
  EXPECT_EQ(std::ranges::count(*names, first_), 1);
  EXPECT_EQ(std::ranges::count(*names, second_), 1);
  EXPECT_FALSE(hasAppeared(first_));
  segments::remove(first_);
  segments::remove(second_);
}

TEST_F(NameWatchTest, DoesNotReportNamesThatExistedOrAreRemoved) {
  publish(first_);
  NameWatch late;

  segments::remove(first_);

  const auto names = late.take();
  ASSERT_TRUE(names);
  EXPECT_EQ(std::ranges::count(*names, first_), 0);
}

// take() reads all events, however many they are.
TEST_F(NameWatchTest, ReportsManyNames) {
  constexpr int kNames = 200;
  std::vector<std::string> published;
  for (int i = 0; i < kNames; ++i) {
    published.push_back(serverName("s" + std::to_string(i)));
    publish(published.back());
  }

  const auto names = watch_.take();

  ASSERT_TRUE(names);
  for (const auto& each : published) {
    EXPECT_EQ(std::ranges::count(*names, each), 1) << each;
    segments::remove(each);
  }
}

// The wait would last for an hour; a new name ends it.
TEST_F(NameWatchTest, WaitEndsWhenANameHasAppeared) {
  publish(first_);

  while (!hasAppeared(first_)) watch_.wait(1h);

  segments::remove(first_);
}

}  // namespace
}  // namespace mpf::tools
