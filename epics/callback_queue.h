// SPDX-License-Identifier: MIT
// CallbackQueue: records of one callback priority whose messages wait. One callback of the IOC
// processes them all: one callback for each record would switch threads for each message.
//
//   add() ──► | records | ── flush() requests the callback ──► Record::processOne()
//
// Threads  any. Records are processed by one thread at a time, a callback thread of the IOC.
#pragma once

#include <callback.h>
#include <mutex>

namespace mpf {

class CallbackQueue {
 public:
  class Record {  // NOLINT(cppcoreguidelines-virtual-class-destructor): nobody deletes a Record
   public:
    // Processes one message. Returns true when the record stays in the queue.
    [[nodiscard]] virtual bool processOne() = 0;

   protected:
    virtual ~Record() = default;

   private:
    friend class CallbackQueue;
    Record* next_ = nullptr;  // in the queue
  };

  //   priority   priorityLow, priorityMedium or priorityHigh
  explicit CallbackQueue(int priority);
  CallbackQueue(const CallbackQueue&) = delete;
  CallbackQueue& operator=(const CallbackQueue&) = delete;

  // The record is not in the queue, and it outlives its time there. Needs no memory.
  void add(Record& record) noexcept;
  // Requests the callback if records wait and it is not pending. The IOC may refuse it, because its
  // own queue is full: the next call tries again.
  void flush();
  // Forgets the records and the callback, which the IOC will not run any more.
  void clear();

 private:
  static void onCallback(epicsCallback* callback);
  void processAll();
  Record* takeAll() noexcept;

  std::mutex mutex_;
  Record* first_ = nullptr;  // all under mutex_
  Record** end_ = &first_;  // where the next record is linked
  bool isPending_ = false;
  epicsCallback callback_{};
};

}  // namespace mpf
