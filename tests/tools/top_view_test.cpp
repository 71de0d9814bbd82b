// SPDX-License-Identifier: MIT
#include <mpf/tools/top_view.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::tools {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

WindowView serverOf(std::uint64_t incarnation, const std::string& name, std::uint64_t received) {
  WindowView server;
  server.isServer = true;
  server.incarnation = incarnation;
  server.name = name;
  server.received = received;
  return server;
}

// Second by second: one takes 10 requests, the other 2000.
std::shared_ptr<const Look> lookAt(std::vector<std::string> names) {
  Survey was;
  Survey is;
  is.atNs = 1'000'000'000;
  std::uint64_t number = 0;
  for (const auto& name : names) {
    ++number;
    was.servers.push_back(serverOf(number, name, 0));
    is.servers.push_back(serverOf(number, name, number == 1 ? 10 : 2000));
  }
  return std::make_shared<const Look>(std::move(was), std::move(is));
}

class TopViewTest : public testing::Test {
 protected:
  TopViewTest() { view_.show(lookAt({"beta", "alpha"})); }
  [[nodiscard]] std::string row(std::size_t number) const { return view_.lines(24).at(2 + number).text; }
  [[nodiscard]] std::string selected() const {
    for (const auto& line : view_.lines(24)) {
      if (line.style == TopLine::Style::selected) return line.text;
    }
    return {};
  }
  void press(std::initializer_list<int> keys) {
    for (const int key : keys) EXPECT_TRUE(view_.handle(key));
  }
  TopView view_;
};

TEST_F(TopViewTest, SortsTextsUpwardsAndNumbersDownwards) {
  EXPECT_THAT(row(0), StartsWith("alpha"));

  ASSERT_TRUE(view_.trySortBy("REQ/s"));
  EXPECT_THAT(row(0), HasSubstr(" 2000 "));

  press({'r'});
  EXPECT_THAT(row(0), HasSubstr(" 10 "));
}

TEST_F(TopViewTest, KeepsTheSelectionWhenTheOrderChanges) {
  press({'j'});
  EXPECT_THAT(selected(), StartsWith("beta"));

  press({'r'});
  EXPECT_THAT(selected(), StartsWith("beta"));
  EXPECT_THAT(row(0), StartsWith("beta"));
}

TEST_F(TopViewTest, HandsTheSelectionOnWhenItsRowHasGone) {
  press({'j'});

  Survey survey;
  survey.servers.push_back(serverOf(2, "alpha", 0));
  view_.show(std::make_shared<const Look>(survey, survey));

  EXPECT_THAT(selected(), StartsWith("alpha"));
}

TEST_F(TopViewTest, ShowsAsManyLinesAsThereIsRoomFor) {
  std::vector<std::string> names;
  for (int i = 100; i < 200; ++i) names.push_back("server" + std::to_string(i));
  view_.show(lookAt(names));

  EXPECT_EQ(view_.lines(24).size(), 24U);
  EXPECT_EQ(view_.lines(0).size(), 102U);

  for (int i = 0; i < 30; ++i) press({kTopPageDown});
  EXPECT_THAT(selected(), StartsWith("server199"));
}

TEST_F(TopViewTest, FitsInto80ColumnsWithUsualNames) {
  view_.show(lookAt({"a name of quite a lot of characters", "powersupply[12]"}));

  for (const auto& line : view_.lines(24)) EXPECT_LE(line.text.size(), 80U) << line.text;
  EXPECT_THAT(row(0), HasSubstr("~"));
}

TEST_F(TopViewTest, SaysThatWhatWasOpenedHasGone) {
  press({kTopEnter});

  view_.show(lookAt({}));

  EXPECT_THAT(view_.lines(24).at(1).text, StartsWith("GONE"));
  press({kTopBack, kTopEnter, 's'});
}

TEST_F(TopViewTest, EndsWithQUnlessOneTypesAFilter) {
  press({'/', 'q', kTopErase, 'b', kTopEnter});

  EXPECT_THAT(row(0), StartsWith("beta"));
  EXPECT_FALSE(view_.handle('q'));
}

}  // namespace
}  // namespace mpf::tools
