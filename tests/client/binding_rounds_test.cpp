// SPDX-License-Identifier: MIT
// BindingRounds: bindings that wait, are due, or are removed, also without memory.
#include "client/binding_rounds.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include <mpf/message_server.h>

#include "shm/segment_name.h"
#include "tests/client/binding_parts_fixture.h"
#include "tests/support/limited_memory.h"

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
    rounds_.add(BindingRounds::Place(bindings_.back()));
    return bindings_.back();
  }
  [[nodiscard]] std::ptrdiff_t waiting() const {
    return std::ranges::count_if(bindings_, [](const auto& each) { return each->isWaiting(); });
  }

  static void connect(Binding& binding, MessageServer& server) {
    binding.tryConnect();
    while (!binding.isConnected()) {
      EXPECT_FALSE(server.receive());
      binding.takeSome(1);
    }
  }
  // Sends a request whose time has passed: the timer of the binding is due.
  static void sendExpired(Binding& binding) {
    Message request = Int32Message();
    ASSERT_EQ(binding.send(request, Deadline::atNs(1), nullptr, Retry::never), SendResult::sent);
  }
  // Calls handleDue() with memory for this number of allocations. Returns false when it throws.
  bool tryHandleDue(int allocations) {
    const LimitedMemory limited(allocations);
    try {
      rounds_.handleDue();
    } catch (const std::bad_alloc&) {
      return false;
    }
    return true;
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
  rounds_.noteName();

  EXPECT_TRUE(rounds_.resume());
  EXPECT_EQ(waiting(), 1);
  EXPECT_TRUE(rounds_.resume());
  EXPECT_EQ(waiting(), 0);

  EXPECT_FALSE(rounds_.resume());
}

// Another thread calls bind() while the constructor's command waits for the dispatcher's thread.
TEST_F(BindingRoundsTest, ABindingThatIsAddedAfterItsTimeWasSeenIsDue) {
  const auto late = std::make_shared<Binding>(parts_, [](Message&&) {});
  bindings_.push_back(late);
  late->setServer("dac", 0);
  late->connectSoon();
  rounds_.handleDue();
  ASSERT_FALSE(parts_.timer.isDue());

  rounds_.add(BindingRounds::Place(late));

  EXPECT_TRUE(parts_.timer.isDue());
}

// A flood of names does not keep bindings from their turn.
TEST_F(BindingRoundsTest, NamesThatAppearDuringARoundBeginTheNextOne) {
  constexpr int kPerStep = Round<Binding>::kPerStep;
  for (int i = 0; i < 3 * kPerStep; ++i) add();

  for (int i = 0; i < 3; ++i) {
    rounds_.noteName();
    rounds_.resume();
  }

  const auto names = backplane_.segmentNames();
  EXPECT_EQ(std::ranges::count_if(names,
                                  [](const auto& name) {
                                    return SegmentName::tryParse(name)->kind ==
                                           NameKind::pendingBind;
                                  }),
            3 * kPerStep)
      << "each binding has looked for its server";
}

TEST_F(BindingRoundsTest, ARoundThatFoundNoMemoryBeginsLater) {
  const MessageServer server(backplane_, "dac");
  add();
  rounds_.noteDeath();
  rounds_.noteName();
  {
    const LimitedMemory limit(0);
    EXPECT_THROW(rounds_.resume(), std::bad_alloc);
  }
  {
    const LimitedMemory limit(1);  // for the round of deaths
    EXPECT_THROW(rounds_.resume(), std::bad_alloc);
  }

  EXPECT_TRUE(rounds_.resume());

  EXPECT_EQ(waiting(), 0);
  EXPECT_FALSE(rounds_.resume());
}

TEST_F(BindingRoundsTest, WatchNamesWhileABindingWaitsForItsServer) {
  const auto binding = add();
  rounds_.noteName();
  rounds_.resume();
  EXPECT_TRUE(binding->isWaiting());
  EXPECT_TRUE(parts_.names.isRunning());

  const MessageServer server(backplane_, "dac");
  rounds_.noteName();
  rounds_.resume();

  EXPECT_FALSE(binding->isWaiting());
  EXPECT_FALSE(parts_.names.isRunning());
}

TEST_F(BindingRoundsTest, AWatchThatCannotStartIsStartedByTheNextAttemptToConnect) {
  const auto binding = add();
  rounds_.noteName();
  {
    const LimitedMemory limit(1);  // for the round
    EXPECT_TRUE(rounds_.resume());
  }
  EXPECT_FALSE(parts_.names.isRunning());
  EXPECT_NE(binding->notConnectedBecause(), "");
  ASSERT_NE(binding->dueNs(), INT64_MAX);

  binding->onTime(binding->dueNs());

  EXPECT_TRUE(parts_.names.isRunning());
}

TEST_F(BindingRoundsTest, EndTheWatchAfterTheLastWaitingBindingIsRemoved) {
  addUnbound();
  const auto binding = add();
  rounds_.noteName();
  rounds_.resume();
  static_cast<void>(parts_.names.takeChange());

  rounds_.remove(*binding);

  EXPECT_TRUE(parts_.names.takeChange()) << "the next step looks whether a binding waits";
  rounds_.noteName();
  rounds_.resume();
  EXPECT_FALSE(parts_.names.isRunning());
}

TEST_F(BindingRoundsTest, KeepARemovedBindingUntilItIsDropped) {
  const std::weak_ptr<Binding> binding = add();
  rounds_.remove(*binding.lock());
  bindings_.clear();
  EXPECT_FALSE(binding.expired());

  rounds_.dropRemoved();

  EXPECT_TRUE(binding.expired());
}

// Its client was destroyed before the dispatcher ran the command that adds it.
TEST_F(BindingRoundsTest, DoNotKeepABindingThatHasLeft) {
  auto binding = std::make_shared<Binding>(parts_, [](Message&&) {});
  binding->leave();

  rounds_.add(BindingRounds::Place(binding));

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
  rounds_.remove(*removed);

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

  rounds_.add(BindingRounds::Place(binding));
  rounds_.handleDue();

  EXPECT_EQ(parts_.timer.due().ns(), binding->dueNs());
}

// Memory runs out at one allocation after the other. The requests of all bindings expire all the
// same, when there is memory again.
TEST_F(BindingRoundsTest, AShortageOfMemoryLosesNoTimer) {
  constexpr int kBindings = 3;
  MessageServer server(backplane_, "dac");
  int fates = 0;
  for (int i = 0; i < kBindings; ++i) {
    bindings_.push_back(std::make_shared<Binding>(parts_, [&fates](const Message& message) {
      if (message.tryAs<RequestFate>() != nullptr) ++fates;
    }));
    bindings_.back()->setServer("dac", 0);
    rounds_.add(BindingRounds::Place(bindings_.back()));
    connect(*bindings_.back(), server);
  }

  int shortages = 0;
  for (bool isShort = true; isShort; ++shortages) {
    for (const auto& binding : bindings_) sendExpired(*binding);
    isShort = !tryHandleDue(shortages);
    while (parts_.timer.isDue()) rounds_.handleDue();
    ASSERT_EQ(fates, kBindings * (shortages + 1)) << "after " << shortages << " allocations";
    EXPECT_FALSE(server.receive()) << "it drops requests that have expired";
  }
  EXPECT_GT(shortages, kBindings) << "each place in the schedule needs memory";
}

// The thread that adds a binding has no caller that it could tell.
TEST_F(BindingRoundsTest, AShortageOfMemoryIsAnErrorBeforeABindingIsAdded) {
  bindings_.push_back(std::make_shared<Binding>(parts_, [](Message&&) {}));
  std::optional<LimitedMemory> limited(std::in_place, 0);
  EXPECT_THROW(BindingRounds::Place(bindings_.back()), std::bad_alloc);
  limited.reset();
  BindingRounds::Place place(bindings_.back());

  limited.emplace(0);
  rounds_.add(std::move(place));
  limited.reset();

  const MessageServer server(backplane_, "dac");
  bindings_.back()->setServer("dac", 0);
  rounds_.noteName();
  EXPECT_TRUE(rounds_.resume());
  EXPECT_FALSE(bindings_.back()->isWaiting()) << "it was added";
}

TEST_F(BindingRoundsTest, ABindingThatIsAddedWithoutMemoryKeepsItsTimer) {
  MessageServer server(backplane_, "dac");
  bool hasExpired = false;
  const auto binding = std::make_shared<Binding>(parts_, [&hasExpired](const Message& message) {
    if (message.tryAs<RequestFate>() != nullptr) hasExpired = true;
  });
  bindings_.push_back(binding);
  binding->setServer("dac", 0);
  connect(*binding, server);
  rounds_.handleDue();
  sendExpired(*binding);
  BindingRounds::Place place(binding);
  std::optional<LimitedMemory> limited(std::in_place, 0);

  EXPECT_THROW(rounds_.add(std::move(place)), std::bad_alloc);

  limited.reset();
  while (parts_.timer.isDue()) rounds_.handleDue();
  EXPECT_TRUE(hasExpired);
}

}  // namespace
}  // namespace mpf::test
