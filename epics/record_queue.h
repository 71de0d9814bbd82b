// SPDX-License-Identifier: MIT
// RecordQueue: messages that wait until their record can process them.
//
//   idle ── push() returns true ──► in its CallbackQueue ── finish() returns false ──► idle
//
// When kMaxMessages wait, a further reply replaces the oldest further reply and counts as an
// overrun; first replies, fates and ConnectMessages are never dropped: their number is limited by
// the requests of the record. If the process has no memory left, only two of them are sure to be
// kept: the end of the request that completes the record's I/O, and the latest ConnectMessage. Any
// other message then counts as an overrun.
//
// Threads  push(): the dispatcher's. tryTake() and finish(): the thread of the callback.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>

#include <mpf/message_of.h>

namespace mpf {

// Whether the message ends the request that it belongs to.
[[nodiscard]] inline bool endsRequest(const Message& message) noexcept {
  return (message.route().flags & kEndsRequest) != 0;
}

class RecordQueue {
 public:
  static constexpr std::size_t kMaxMessages = 64;

  // Returns true when the caller must add the record to its CallbackQueue.
  [[nodiscard]] bool push(Message&& message) noexcept;
  // Takes the oldest message that the record can process now.
  //   isRequestOutstanding  further replies must wait until the first reply has ended the request
  [[nodiscard]] bool tryTake(Message& message, bool isRequestOutstanding) noexcept;
  // Returns true when the record stays in its CallbackQueue.
  [[nodiscard]] bool finish(bool isRequestOutstanding) noexcept;
  [[nodiscard]] std::uint64_t overruns() const;

 private:
  [[nodiscard]] std::deque<Message>::iterator next(bool isRequestOutstanding);
  void dropOldest();
  void keep(Message&& message) noexcept;
  [[nodiscard]] Message* reserved() noexcept;

  mutable std::mutex mutex_;
  std::deque<Message> messages_;  // all under mutex_
  Message end_, connect_;  // for which there was no memory in messages_; taken last
  bool isInCallbackQueue_ = false;
  std::uint64_t overruns_ = 0;
};

}  // namespace mpf
