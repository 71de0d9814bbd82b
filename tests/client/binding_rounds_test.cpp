// SPDX-License-Identifier: MIT
#include "client/binding_rounds.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <vector>

#include <mpf/message_server.h>

#include "tests/client/binding_parts_fixture.h"

namespace mpf::test {
namespace {

class BindingRoundsTest : public BindingPartsTest {
 protected:
  void TearDown() override {
    for (const auto& binding : bindings_) binding->leave();
  }
  // Adds a binding that waits for the server "dac".
  std::shared_ptr<Binding> add() {
    const auto binding = addUnbound();
    binding->setServer("dac", 0);
    return binding;
  }
  // Adds a binding that waits for nothing.
  std::shared_ptr<Binding> addUnbound() {
    bindings_.push_back(std::make_shared<Binding>(parts_, [](Message&&) {}));
    rounds_.add(bindings_.back());
    return bindings_.back();
  }
  [[nodiscard]] std::ptrdiff_t waiting() const {
    return std::ranges::count_if(bindings_, [](const auto& each) { return each->isWaiting(); });
  }

  std::vector<std::shared_ptr<Binding>> bindings_;
  BindingRounds rounds_{parts_};
};

TEST_F(BindingRoundsTest, NoRoundIsInProgressAtFirst) {
  add();

  EXPECT_FALSE(rounds_.resume());
  EXPECT_EQ(waiting(), 1);
}

TEST_F(BindingRoundsTest, ConnectTheWaitingBindingsInSteps) {
  constexpr int kPerStep = Round<Binding>::kPerStep;
  const MessageServer server(backplane_, "dac");
  for (int i = 0; i < kPerStep + 1; ++i) add();
  rounds_.beginWaiting();

  EXPECT_TRUE(rounds_.resume());
  EXPECT_EQ(waiting(), 1);
  EXPECT_TRUE(rounds_.resume());
  EXPECT_EQ(waiting(), 0);

  EXPECT_FALSE(rounds_.resume());
}

TEST_F(BindingRoundsTest, WatchNamesWhileABindingWaitsForItsServer) {
  const auto binding = add();
  rounds_.beginWaiting();
  rounds_.resume();
  EXPECT_TRUE(binding->isWaiting());
  EXPECT_TRUE(parts_.names.isRunning());

  const MessageServer server(backplane_, "dac");
  rounds_.beginWaiting();
  rounds_.resume();

  EXPECT_FALSE(binding->isWaiting());
  EXPECT_FALSE(parts_.names.isRunning());
}

TEST_F(BindingRoundsTest, EndTheWatchAfterTheLastWaitingBindingIsRemoved) {
  addUnbound();
  const auto binding = add();
  rounds_.beginWaiting();
  rounds_.resume();
  static_cast<void>(parts_.names.takeChange());

  rounds_.remove(binding);

  EXPECT_TRUE(parts_.names.takeChange()) << "the next step looks whether a binding waits";
  rounds_.beginWaiting();
  rounds_.resume();
  EXPECT_FALSE(parts_.names.isRunning());
}

TEST_F(BindingRoundsTest, KeepARemovedBindingUntilItIsDropped) {
  const std::weak_ptr<Binding> binding = add();
  rounds_.remove(binding.lock());
  bindings_.clear();
  EXPECT_FALSE(binding.expired());

  rounds_.dropRemoved();

  EXPECT_TRUE(binding.expired());
}

// Its client was destroyed before the dispatcher ran the command that adds it.
TEST_F(BindingRoundsTest, DoNotKeepABindingThatHasLeft) {
  auto binding = std::make_shared<Binding>(parts_, [](Message&&) {});
  binding->leave();

  rounds_.add(binding);

  EXPECT_EQ(binding.use_count(), 1);
}

TEST_F(BindingRoundsTest, HandlingOfDueBindingsSetsTheTimerOfTheNext) {
  const MessageServer server(backplane_, "dac");
  const auto binding = add();
  binding->tryConnect();
  ASSERT_NE(binding->dueNs(), INT64_MAX) << "it rings again if the server does not answer";
  parts_.timer.reset();

  rounds_.handleDue();

  EXPECT_EQ(parts_.timer.due().ns(), binding->dueNs());
}

TEST_F(BindingRoundsTest, HandleEachBindingWhenItIsDueAndNoOther) {
  const MessageServer server(backplane_, "dac");
  const auto first = add();
  const auto removed = add();
  const auto second = add();
  for (const auto& binding : {first, removed, second}) binding->tryConnect();
  const auto firstNs = first->dueNs();
  const auto removedNs = removed->dueNs();
  const auto secondNs = second->dueNs();
  ASSERT_LT(firstNs, secondNs);
  rounds_.remove(removed);

  rounds_.handleDue();
  while (first->dueNs() == firstNs || second->dueNs() == secondNs) {
    EXPECT_LE(parts_.timer.due().ns(), std::max(firstNs, secondNs));
    rounds_.handleDue();
  }

  EXPECT_GT(first->dueNs(), firstNs) << "it rings again later";
  EXPECT_GT(second->dueNs(), secondNs);
  EXPECT_EQ(removed->dueNs(), removedNs);
  rounds_.handleDue();
  EXPECT_EQ(parts_.timer.due().ns(), std::min(first->dueNs(), second->dueNs()));
}

// Its time was lowered before the command that adds it.
TEST_F(BindingRoundsTest, ABindingIsScheduledWhenItIsAdded) {
  const MessageServer server(backplane_, "dac");
  bindings_.push_back(std::make_shared<Binding>(parts_, [](Message&&) {}));
  const auto& binding = bindings_.back();
  binding->setServer("dac", 0);
  binding->tryConnect();
  rounds_.handleDue();
  parts_.timer.reset();

  rounds_.add(binding);
  rounds_.handleDue();

  EXPECT_EQ(parts_.timer.due().ns(), binding->dueNs());
}

}  // namespace
}  // namespace mpf::test
