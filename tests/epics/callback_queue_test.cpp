// SPDX-License-Identifier: MIT
#include "epics/callback_queue.h"

#include <semaphore>
#include <string>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

// A callback of other software in the same IOC.
class OtherCallback {
 public:
  OtherCallback() {
    callbackSetCallback(
        [](epicsCallback* callback) {
          void* user = nullptr;
          callbackGetUser(user, callback);
          auto& self = *static_cast<OtherCallback*>(user);
          self.begun_.release();
          self.mayEnd_.acquire();
        },
        &callback_);
    callbackSetUser(this, &callback_);
    callbackSetPriority(priorityLow, &callback_);
  }
  // Returns false when the queue of the IOC is full.
  bool request() { return callbackRequest(&callback_) == 0; }
  void waitForBegin() { begun_.acquire(); }
  void letEnd() { mayEnd_.release(); }
  // Waits until all callbacks that were requested before this call have ended. A run that had begun
  // ends, too, and another one has begun instead.
  void passThrough() {
    ASSERT_TRUE(request());
    letEnd();
    waitForBegin();
  }

 private:
  std::counting_semaphore<> begun_{0}, mayEnd_{0};
  epicsCallback callback_{};
};

class CallbackQueueTest : public EpicsTest {
 protected:
  // A record that has some messages, and writes its name to log_ for each that it processes.
  class TestRecord final : public CallbackQueue::Record {
   public:
    TestRecord(std::string& log, char name, int messages)
        : log_(log), name_(name), messages_(messages) {}
    bool processOne() override {
      log_ += name_;
      return --messages_ > 0;
    }

   private:
    std::string& log_;
    const char name_;
    int messages_;
  };

  CallbackQueue queue_{priorityLow};
  OtherCallback other_, filler_;
  std::string log_;  // written by the callback thread, read after other_.passThrough()
  TestRecord three_{log_, 'a', 3}, one_{log_, 'b', 1};
  const Ioc ioc_{""};  // its callback threads end first
};

TEST_F(CallbackQueueTest, RecordsProcessOneMessageEachInTurn) {
  queue_.add(three_);
  queue_.add(one_);
  queue_.flush();
  for (int round = 0; round < 3; ++round) other_.passThrough();
  EXPECT_EQ(log_, "abaa");
}

TEST_F(CallbackQueueTest, OtherCallbacksHaveTheirTurnBetweenTheMessagesOfARecord) {
  ASSERT_TRUE(other_.request());
  other_.waitForBegin();
  queue_.add(three_);
  queue_.flush();
  other_.passThrough();
  EXPECT_EQ(log_, "a");
  other_.passThrough();
  EXPECT_EQ(log_, "aa");
  other_.passThrough();
  EXPECT_EQ(log_, "aaa");
  other_.letEnd();
}

TEST_F(CallbackQueueTest, NothingIsProcessedBeforeAFlush) {
  queue_.add(one_);
  other_.passThrough();
  EXPECT_EQ(log_, "");

  queue_.flush();
  other_.passThrough();
  EXPECT_EQ(log_, "b");
}

TEST_F(CallbackQueueTest, ACallbackThatTheIocRefusedIsRequestedByTheNextFlush) {
  ASSERT_TRUE(filler_.request());
  filler_.waitForBegin();
  int requested = 1;
  while (filler_.request()) ++requested;
  queue_.add(one_);
  queue_.flush();
  while (requested-- > 0) filler_.letEnd();
  while (!other_.request()) std::this_thread::yield();
  other_.waitForBegin();
  EXPECT_EQ(log_, "");
  other_.letEnd();

  queue_.flush();
  other_.passThrough();
  EXPECT_EQ(log_, "b");
}

TEST_F(CallbackQueueTest, RecordsThatWereClearedAreNotProcessed) {
  queue_.add(three_);
  queue_.clear();
  queue_.flush();
  other_.passThrough();
  EXPECT_EQ(log_, "");

  queue_.add(one_);
  queue_.flush();
  other_.passThrough();
  EXPECT_EQ(log_, "b");
}

}  // namespace
}  // namespace mpf::test
