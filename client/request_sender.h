// SPDX-License-Identifier: MIT
// RequestSender: sends the requests of one client over the present link to its server.
//
// Threads  any, unless a comment says: the dispatcher's thread. A spin lock guards the data.
// Crash    a request in the table that was not sent, or not taken, gets a fate from the binding.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>

#include <mpf/message_client.h>

#include "client/binding_state.h"
#include "client/binding_timer.h"
#include "client/nudge_interval.h"
#include "client/request_table.h"
#include "client/untaken_requests.h"
#include "shm/messages/message_link.h"
#include "shm/messages/message_run.h"
#include "shm/messages/value_run.h"

namespace mpf {

class RequestSender {
 public:
  //   state            of the binding; it becomes or stops being `connected` under lock()
  //   control          counts refusals
  //   timer            wakes the dispatcher at deadlines of requests, and to nudge the server
  //   postFullReport   called under lock() for the first refusal of a series
  RequestSender(const std::atomic<BindingState>& state, layout::WindowControl& control,
                BindingTimer& timer, std::function<void()> postFullReport)
      : state_(state),
        control_(control),
        timer_(timer),
        postFullReport_(std::move(postFullReport)) {}

  // As MessageClient::send().
  SendResult send(Message& message, Deadline takeBefore, std::uint32_t* requestId,
                  Retry retry) noexcept;
  // As RelayClient::sendAs().
  SendResult sendAs(std::uint32_t requestId, Message& message, Deadline takeBefore) noexcept;
  std::size_t sendAs(const MessageRun& run) noexcept;
  // As MessageClient::sendMany(), of messages and of values.
  SentMany sendMany(std::span<Message> messages, Deadline takeBefore,
                    std::span<std::uint32_t> requestIds) noexcept;
  SentMany sendBodies(const Bodies& bodies, Deadline takeBefore,
                      std::span<std::uint32_t> requestIds) noexcept;
  BodyBytes allocate(std::size_t bytes);
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;
  [[nodiscard]] const std::shared_ptr<BiasedLock>& lock() const noexcept { return lock_; }

  // --- dispatcher's thread ---
  // Uses a new link and a new table of requests.
  //   throws  std::bad_alloc; then nothing has changed
  void open(std::shared_ptr<MessageLink> channel);
  // The link has ended. The table stays until the next open().
  void close() noexcept;
  // nullptr between close() and open().
  [[nodiscard]] const std::shared_ptr<MessageLink>& channel() const noexcept { return channel_; }
  // nullptr before the first open().
  [[nodiscard]] const std::shared_ptr<RequestTable>& requests() const noexcept { return requests_; }
  // The id of the first request, from place `at` of the table on, whose deadline has passed and
  // that the server has not counted as taken; 0: none. `at` becomes the next place. Lowers `nextNs`
  // to the deadlines that have not passed of the requests before it.
  [[nodiscard]] std::uint32_t findExpired(std::uint32_t& at, std::int64_t nowNs,
                                          std::int64_t& nextNs) noexcept;
  // Keeps a request that no server has taken, if it has a copy: the request ends in the table, and
  // trySendUntaken() sends it. Returns false when it has none, or there is no memory.
  [[nodiscard]] bool tryKeep(Request& request) noexcept;
  // Sends the first request that was kept; it is kept until the result is `sent`.
  [[nodiscard]] SendResult trySendUntaken() noexcept;
  [[nodiscard]] const UntakenRequests& untaken() const noexcept { return untaken_; }
  template <class Predicate>
  std::optional<UntakenRequest> takeUntaken(Predicate&& isWanted) {
    const BiasedLock::Guard lock(*lock_);
    return untaken_.take(std::forward<Predicate>(isWanted));
  }
  // Returns true when no reply is outstanding; the next send() then starts the nudging again.
  bool tryEndNudging() noexcept;

 private:
  // last: behind the requests that were kept; firstUntaken: the first one of those.
  enum class Turn { last, firstUntaken };
  //   requestId   in: the id for the request, or 0 for a new one; out: its id when it was sent
  //   copy        nullptr, or a copy to keep until the request is taken; moved from if it was sent
  SendResult sendInTurn(Message& message, std::int64_t deadlineNs, std::uint32_t& requestId,
                        std::unique_ptr<Message>* copy, Turn turn) noexcept;
  // The same for the less frequent kinds of requests: the code exists twice, so that it is short in
  // send().
  SendResult sendOutOfLine(Message& message, std::int64_t deadlineNs, std::uint32_t& requestId,
                           std::unique_ptr<Message>* copy, Turn turn) noexcept;
  SendResult trySendLocked(Message& message, std::int64_t deadlineNs, std::uint32_t& requestId,
                           std::unique_ptr<Message>* copy) noexcept;
  // Calls `sendNext(index)` until `count` requests are sent, or one is not. It sends the request of
  // this index, and as many of the next ones as it can.
  template <class SendNext>
  SentMany sendInBatch(std::size_t count, std::int64_t deadlineNs,
                       const SendNext& sendNext) noexcept;
  std::size_t sendRunLocked(const MessageRun& run) noexcept;
  SentMany sendNextLocked(const Bodies& bodies, std::int64_t deadlineNs,
                          std::span<std::uint32_t> requestIds) noexcept;
  std::size_t sendRunLocked(const Bodies& bodies, std::int64_t deadlineNs,
                            std::span<std::uint32_t> requestIds) noexcept;
  SendResult sendWithCopy(Message& message, std::int64_t deadlineNs,
                          std::uint32_t* requestId) noexcept;
  SendResult tryGrow() noexcept;
  SendResult takeBack(Request& request, SendResult result, std::unique_ptr<Message>* copy) noexcept;
  void setTimers(bool startsNudging, std::int64_t deadlineNs) noexcept;
  SendResult refuseBehindUntaken() noexcept;
  void noteFull() noexcept;

  const std::atomic<BindingState>& state_;
  layout::WindowControl& control_;
  BindingTimer& timer_;
  std::function<void()> postFullReport_;
  std::shared_ptr<BiasedLock> lock_ = std::make_shared<BiasedLock>();
  std::shared_ptr<MessageLink> channel_;  // written by the dispatcher's thread under lock_
  std::shared_ptr<RequestTable> requests_;  // likewise
  UntakenRequests untaken_;
  bool isFullReported_ = false;  // under lock_: the present series of refusals has been reported
  bool isNudging_ = false;  // under lock_: a time for the next nudge is set
};

}  // namespace mpf
