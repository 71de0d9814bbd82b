// SPDX-License-Identifier: MIT
// Progress: what the window of a server shows about its requests.
#include "server/progress.h"

#include <gtest/gtest.h>
#include <memory>

#include <mpf/message_types.h>

#include "shm/handling.h"

namespace mpf::test {
namespace {

class ProgressTest : public testing::Test {
 protected:
  [[nodiscard]] std::optional<Handling> handling() const {
    return Handling::of(control_->handling.load(std::memory_order_relaxed));
  }
  // The server has taken `requests` more requests until `nowNs`.
  void note(std::uint64_t requests, std::int64_t nowNs) {
    control_->received.fetch_add(requests, std::memory_order_relaxed);
    progress_.note(nowNs);
  }

  std::unique_ptr<layout::WindowControl> control_ = std::make_unique<layout::WindowControl>();
  Progress progress_{*control_};
};

TEST_F(ProgressTest, ShowsTheRequestUntilItHasBeenHandled) {
  EXPECT_FALSE(handling());

  progress_.begin(MessageType::int32, -7);
  const auto shown = handling();
  progress_.end();

  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->type, static_cast<std::uint16_t>(MessageType::int32));
  EXPECT_EQ(shown->cmd, -7);
  EXPECT_FALSE(handling());
}

TEST_F(ProgressTest, ARequestWithoutACmdHasCmd0) {
  progress_.begin(MessageType::serialConfig, 2);

  ASSERT_TRUE(handling());
  EXPECT_EQ(handling()->cmd, 0);
}

TEST_F(ProgressTest, ShowsTheTimeOfTheLastRequest) {
  note(1, 5'000'000);

  EXPECT_EQ(control_->progressAtNs.load(std::memory_order_relaxed), 5'000'000u);
}

TEST_F(ProgressTest, AServerIsSlowWhileItsRequestsTakeLong) {
  note(0, 1'000'000'000);
  note(10, 1'001'000'000);
  EXPECT_TRUE(progress_.isDue()) << "100 us for each request";

  note(1000, 1'002'000'000);
  EXPECT_FALSE(progress_.isDue()) << "1 us for each request";

  note(1, 1'003'000'000);

  EXPECT_TRUE(progress_.isDue());
}

TEST_F(ProgressTest, NotesTheFirstRequestAfterASleep) {
  note(0, 1'000'000'000);
  note(1000, 1'001'000'000);
  ASSERT_FALSE(progress_.isDue());

  progress_.noteSleep();
  EXPECT_TRUE(progress_.isDue());

  note(1, 2'000'000'000);
  note(1000, 2'001'000'000);
  EXPECT_FALSE(progress_.isDue());
}

}  // namespace
}  // namespace mpf::test
