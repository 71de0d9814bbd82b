// SPDX-License-Identifier: MIT
// Clients of a process without memory: nothing hangs, ends the process, is lost or stays in
// /dev/shm.
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <thread>

#include <mpf/message_server.h>

#include "client/untaken_requests.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "shm/watcher.h"
#include "tests/client/binding_parts_fixture.h"
#include "tests/support/limited_memory.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

constexpr int kMost = 100;  // more allocations than a function below makes
const std::string kLongName = "a server with a name that needs memory";

// Calls `act` with memory for 0, 1, 2 ... allocations, until it succeeds.
template <class Act>
void withMoreAndMoreMemory(const Act& act) {
  for (int allocations = 0; allocations < kMost; ++allocations) {
    const LimitedMemory limit(allocations);
    try {
      return act();
    } catch (const std::bad_alloc&) {
      continue;
    }
  }
  FAIL() << "it never succeeds";
}

class NoMemoryTest : public testing::Test {
 protected:
  Watchdog watchdog_{"no memory"};
  TestBackplane backplane_;
};

TEST_F(NoMemoryTest, ADispatcherThatCannotBeMadeLeavesNoFiles) {
  const auto options = std::make_unique<DispatcherOptions>();

  withMoreAndMoreMemory(
      [&] { const std::unique_ptr<Dispatcher> made(new Dispatcher(backplane_, *options)); });

  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
}

TEST_F(NoMemoryTest, AClientThatCouldNotBeBoundMayBeBoundAgain) {
  const MessageServer server(backplane_, kLongName);
  Dispatcher dispatcher(backplane_);
  for (int allocations = 0; allocations < kMost; ++allocations) {
    MessageClient client(dispatcher, [](const Message&) {});
    const LimitedMemory limit(allocations);
    bool isBound = true;
    try {
      client.bind(kLongName);
    } catch (const std::bad_alloc&) {
      isBound = false;
    }
    allocationsLeft = kUnlimited;
    if (isBound) EXPECT_THROW(client.bind(kLongName), std::logic_error);
    else EXPECT_NO_THROW(client.bind(kLongName));
  }

  EXPECT_EQ(backplane_.segmentNames().size(), 6u) << "two windows with their hints and FIFOs";
}

TEST_F(NoMemoryTest, ARequestThatCannotBeKeptKeepsItsCopy) {
  UntakenRequests kept;
  Request request;
  request.id = 1;
  request.copy = std::make_unique<Message>(Int32Message({.value = 7}));
  {
    const LimitedMemory limit(0);
    EXPECT_FALSE(kept.tryAdd(request));
  }

  EXPECT_TRUE(kept.isEmpty());
  ASSERT_NE(request.copy, nullptr);
  EXPECT_EQ(request.copy->tryAs<Int32>()->value, 7);
}

TEST_F(NoMemoryTest, AClientIsDestroyedWithoutMemory) {
  MessageServer server(backplane_, kLongName);
  Dispatcher dispatcher(backplane_);
  std::optional<MessageClient> client(std::in_place, dispatcher, [](const Message&) {});
  client->bind(kLongName);
  while (!client->isConnected()) {
    server.handleOne();
    dispatcher.runOnce(Deadline::after(std::chrono::milliseconds(1)));
  }
  ASSERT_EQ(client->send(client->alloc<Float64Array>(10'000)), SendResult::sent);
  {
    const LimitedMemory limit(0);
    client.reset();
  }

  for (const auto& name : backplane_.segmentNames()) {
    EXPECT_NE(SegmentName::tryParse(name)->kind, NameKind::link);
    EXPECT_NE(SegmentName::tryParse(name)->kind, NameKind::bulk);
  }
}

// A client that waits for its server.
TEST_F(NoMemoryTest, AClientOfASharedDispatcherIsDestroyedWithoutMemory) {
  std::optional<MessageClient> client(std::in_place, backplane_, [](const Message&) {});
  std::atomic<bool> isCalled{false};
  MessageServer server(backplane_, "dac");
  MessageClient other(backplane_, [&](const Message&) {
    allocationsLeft = 0;  // of the dispatcher's thread
    isMemoryLimited = true;
    isCalled = true;
    isCalled.notify_one();
  });
  other.bind("dac");
  client->bind(kLongName);
  while (!isCalled) EXPECT_FALSE(server.receive());

  client.reset();

  isMemoryLimited = false;
  EXPECT_EQ(std::ranges::count_if(backplane_.segmentNames(),
                                  [](const auto& name) {
                                    return SegmentName::tryParse(name)->kind ==
                                           NameKind::pendingBind;
                                  }),
            0);
}

TEST_F(NoMemoryTest, AWatcherReportsANameLater) {
  const auto failed = failedAllocations.load();
  std::atomic<int> calls{0};
  Watcher watcher(backplane_.name());
  const auto token = watcher.watchNames(NameKind::serverWindow, [&] {
    allocationsLeft = 0;  // of the watcher's thread
    ++calls;
  });
  const MessageServer first(backplane_, "first");
  isMemoryLimited = true;
  while (calls == 0) std::this_thread::yield();
  const auto before = calls.load();

  const MessageServer second(backplane_, "second");

  while (failedAllocations == failed) std::this_thread::yield();
  isMemoryLimited = false;
  const Dispatcher other(backplane_);  // names that are of other kinds, and come first
  while (calls == before) std::this_thread::yield();
  watcher.forget(token);
}

class BindingWithoutMemoryTest : public BindingPartsTest {
 protected:
  void TearDown() override { owner_->leave(); }
};

TEST_F(BindingWithoutMemoryTest, TriesAgainAfterAFailureWhoseReasonNeedsMemory) {
  const auto window = SegmentName::serverWindow(backplane_.name(), 0, "dac");
  std::ofstream{segments::path(window)};  // an empty file, which is no window
  owner_->setServer("dac", 0);
  for (int allocations = 0; allocations < kMost; ++allocations) {
    const LimitedMemory limit(allocations);

    EXPECT_NO_THROW(owner_->tryConnect());
  }

  EXPECT_NE(owner_->dueNs(), INT64_MAX);
  segments::remove(window);
}

TEST_F(BindingWithoutMemoryTest, DisconnectsWithoutMemory) {
  MessageServer server(backplane_, "dac");
  owner_->setServer("dac", 0);
  owner_->tryConnect();
  while (!owner_->isConnected()) {
    EXPECT_FALSE(server.receive());
    owner_->takeSome(1);
  }
  {
    const LimitedMemory limit(0);

    EXPECT_NO_THROW(owner_->disconnect("a reason that needs memory", Binding::Ending::serverGone));
  }

  EXPECT_FALSE(owner_->isConnected());
  EXPECT_TRUE(owner_->isWaiting());
}

}  // namespace
}  // namespace mpf::test
