// SPDX-License-Identifier: MIT
// Binding: the connection of one client to one server, through restarts of the server.
//
//   unbound ─bind─► waiting ─server found─► connecting ─accepted─► connected ─server gone─► waiting
//
// Threads  the two sections of the public functions name the thread that may call them: any thread,
//          or the thread that runs the dispatcher.
// Crash    after the death of the server, the binding delivers the messages that the server had
//          sent, then a fate for each remaining request, then the disconnect.
// Trust    invalid data from the server ends the connection.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <mpf/message_client.h>

#include "client/request_table.h"
#include "shm/endpoint.h"
#include "shm/messages/message_link.h"

namespace mpf {

class Binding : public std::enable_shared_from_this<Binding> {
 public:
  Binding(Dispatcher::Impl& dispatcher, MessageClient::Callback callback)
      : dispatcher_(dispatcher), callback_(std::move(callback)) {}

  // --- any thread ---
  //   requestId   in: the id for the request, or 0 for a new one; out: its id when it was sent
  SendResult send(Message& message, Deadline takeBefore, std::uint32_t& requestId) noexcept;
  BodyBytes allocate(std::size_t bytes);
  [[nodiscard]] bool isConnected() const noexcept {
    return connected_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;
  [[nodiscard]] std::string notConnectedBecause() const;
  // PAIR(bound): server_ and location_.
  [[nodiscard]] bool isBound() const noexcept { return bound_.load(std::memory_order_acquire); }
  void setServer(const std::string& server, std::int32_t location);
  bool waitConnected(Deadline deadline);

  // --- dispatcher's thread ---
  void tryConnect();
  // Handles one message or one change of state of the link. Returns false when there was none.
  bool takeOne();
  enum class Ending {
    // The server is dead or has closed the link: it will not receive the remaining requests.
    serverGone,
    // The server refused the link: the client tries again later.
    refused,
    // The client ends the connection: the server may still receive requests for a while.
    protocolError,
  };
  void disconnect(const std::string& reason, Ending ending);
  void cancel(std::uint32_t requestId);
  // Between pause() and resume(), messages of the server stay in the link.
  void pause();
  void resume();
  // Ends the connection. No callback runs after it.
  void leave();
  // Does what is due: ends expired requests, rings again for hints that may have been lost.
  void onTime(std::int64_t nowNs);
  [[nodiscard]] std::int64_t dueNs() const noexcept {
    return dueNs_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool hasLeft() const noexcept { return left_; }
  [[nodiscard]] bool isWaiting() const noexcept { return !channel_ && isBound() && !left_; }
  [[nodiscard]] bool hasDeadPeer() const noexcept;
  void reportQueueFull();

 private:
  void deliver(Message&& message);
  void deliverConnect(ConnectStatus status);
  void deliverFate(Request& request, Fate fate);
  bool tryDeliverReply(const Envelope& envelope);
  void deliverRemaining(const MessageLink* channel);
  void resumeEnd();
  void endAll();
  void closeChannel();
  void lookForServer(Ending ending);
  void noteTimes(const Envelope& envelope, const Request* request) noexcept;
  bool onLinkState();
  void makeChannel(const std::shared_ptr<PeerWindow>& server);
  void pendingBind();
  [[nodiscard]] std::string notAcceptedBecause(const PeerWindow& server) const;
  void setReason(const std::string& reason);
  [[nodiscard]] std::string shortageAt(const layout::WindowControl& server) const;
  void wakeAt(std::int64_t ns) noexcept;
  void noteFull() noexcept;
  static constexpr std::int64_t kRetryNs = 1'000'000'000;
  static constexpr std::int64_t kFirstNudgeNs = 50'000'000;
  static constexpr std::int64_t kLastNudgeNs = 1'000'000'000;
  void expire(std::int64_t nowNs);
  void nudge(std::int64_t nowNs);
  bool endNudging();

  Dispatcher::Impl& dispatcher_;
  MessageClient::Callback callback_;
  std::string server_;
  std::int32_t location_ = 0;
  std::atomic<bool> bound_{false};
  std::shared_ptr<SpinLock> lock_ = std::make_shared<SpinLock>();
  std::shared_ptr<MessageLink> channel_;  // written by the dispatcher's thread under lock_
  std::shared_ptr<RequestTable> requests_;  // likewise
  std::atomic<bool> connected_{false};  // under lock_
  bool isFullReported_ = false;  // under lock_: the present series of refusals has been reported
  bool nudging_ = false;  // under lock_: a time for the next nudge() is set
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  std::int64_t knockedNs_ = 0;
  std::int64_t nudgeEveryNs_ = 0;
  std::uint32_t index_ = 0;
  std::uint64_t incarnation_ = 0;  // of the server
  bool left_ = false;
  bool paused_ = false;
  // The state of a disconnect() that is delivering messages, or whose callback has thrown.
  struct End {
    Ending ending;
    bool wasConnected;
    std::uint32_t remainingSlots;  // of the server's ring that are still to be delivered
    bool isInterrupted = false;  // by an exception: resumeEnd() is due
  };
  std::optional<End> end_;
  Segment pendingBind_;
  mutable std::mutex reasonMutex_;
  std::condition_variable connectedChanged_;
  std::string reason_ = "not bound to a server yet";
};

}  // namespace mpf
