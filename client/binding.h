// SPDX-License-Identifier: MIT
// Binding: the connection of one client to one server, through restarts of the server.
//
//   RequestSender ─ requests ─► server ─ replies ─► Binding ─► callback
//   Connector       finds the server and makes the connection
//   BindingState    the states, with their diagram
//
// Threads  the two sections of the public functions name the thread that may call them: any thread,
//          or the thread that runs the dispatcher.
// Crash    after the death of the server, the binding delivers the messages that the server had
//          sent, then a fate for each remaining request, then the disconnect.
// Trust    invalid data from the server ends the connection.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <string_view>

#include <mpf/message_client.h>

#include "client/binding_state.h"
#include "client/binding_timer.h"
#include "client/connector.h"
#include "client/dispatcher_parts.h"
#include "client/nudge_interval.h"
#include "client/request_sender.h"
#include "client/run_receiver.h"
#include "client/value_handler.h"

namespace mpf {

class Binding final : public LinkUser, public std::enable_shared_from_this<Binding> {
 public:
  Binding(DispatcherParts& parts, MessageClient::Callback callback)
      : parts_(parts), callback_(std::move(callback)) {}

  // --- any thread ---
  // As the functions of RequestSender.
  SendResult send(Message& message, Deadline takeBefore, std::uint32_t* requestId,
                  Retry retry) noexcept {
    return sender_.send(message, takeBefore, requestId, retry);
  }
  SendResult sendAs(std::uint32_t requestId, Message& message, Deadline takeBefore) noexcept {
    return sender_.sendAs(requestId, message, takeBefore);
  }
  std::size_t sendAs(const MessageRun& run) noexcept { return sender_.sendAs(run); }
  SentMany sendMany(std::span<Message> messages, Deadline takeBefore,
                    std::span<std::uint32_t> requestIds) noexcept {
    return sender_.sendMany(messages, takeBefore, requestIds);
  }
  SentMany sendBodies(const Bodies& bodies, Deadline takeBefore,
                      std::span<std::uint32_t> requestIds) noexcept {
    return sender_.sendBodies(bodies, takeBefore, requestIds);
  }
  BodyBytes allocate(std::size_t bytes) { return sender_.allocate(bytes); }
  [[nodiscard]] bool isConnected() const noexcept { return state() == BindingState::connected; }
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept { return sender_.maxMessageBytes(); }
  [[nodiscard]] std::int32_t serverPid() const noexcept;
  [[nodiscard]] std::string notConnectedBecause() const {
    return isConnected() ? std::string() : connector_.notConnectedBecause();
  }
  //   throws  as Connector::setServer()
  void setServer(const std::string& server, std::int32_t location);
  //   throws  std::logic_error after setServer(), and for a second handler
  void setValueHandler(ValueHandler handler);
  // Call it before setServer().
  void setRunReceiver(RunReceiver& receiver) noexcept { runs_ = &receiver; }
  bool waitConnected(Deadline deadline) {
    return connector_.wait(deadline, [this] { return isConnected(); });
  }
  // When onTime() is due.
  [[nodiscard]] std::int64_t dueNs() const noexcept { return timer_.dueNs(); }
  [[nodiscard]] std::int64_t takeReportedDueNs() noexcept { return timer_.takeReported(); }

  // --- dispatcher's thread ---
  void tryConnect();
  // Handles up to `most` messages or runs of values of the link, or one change of its state. The
  // messages of a run for a RunReceiver count one by one; the last run may exceed `most`. Returns
  // false when there was nothing to handle.
  bool takeSome(int most);
  enum class Ending {
    // The server is dead or has closed the link: it will not receive the remaining requests.
    serverGone,
    // The server refused the link: the client tries again later.
    refused,
    // The client ends the connection: the server may still receive requests for a while.
    protocolError,
  };
  void disconnect(std::string_view reason, Ending ending);
  void cancel(std::uint32_t requestId);
  // Between pause() and resume(), messages of the server stay in the link.
  void pause();
  void resume();
  // Ends the connection. No callback runs after it. Needs no memory.
  void leave();
  // Connects in the next step. Any thread, after setServer().
  void connectSoon() noexcept { timer_.wakeAt(Clock::nowNs()); }
  // Does what is due: ends expired requests, rings again for hints that may have been lost.
  void onTime(std::int64_t nowNs);
  [[nodiscard]] bool hasLeft() const noexcept { return state() == BindingState::left; }
  [[nodiscard]] bool isWaiting() const noexcept {
    // PAIR(bound): the server's name, which bind() has stored.
    return state_.load(std::memory_order_acquire) == BindingState::waiting;
  }
  [[nodiscard]] bool hasDeadPeer() const noexcept;
  // Whether the last call of tryConnect() failed because of a shortage.
  [[nodiscard]] bool lacksResources() const noexcept { return lacksResources_; }

 private:
  // The pause before requests are sent again that found no room at the server.
  static constexpr std::int64_t kSendUntakenAfterNs = 1'000'000;

  // What disconnect() delivers.
  struct End {
    Ending ending{};
    bool wasConnected = false;
    std::uint32_t remainingSlots = 0;  // of the server's ring that are still to be delivered
  };

  [[nodiscard]] BindingState state() const noexcept {
    return state_.load(std::memory_order_relaxed);
  }
  void setState(BindingState state) noexcept;
  // A link exists, and its end has not begun.
  [[nodiscard]] bool isLinked() const noexcept {
    const auto now = state();
    return now == BindingState::connecting || now == BindingState::connected;
  }
  [[nodiscard]] MessageLink& channel() const noexcept { return *sender_.channel(); }
  [[nodiscard]] layout::WindowControl& control() const noexcept {
    return parts_.endpoint.control();
  }

  // Takes the next message of the link and delivers it. Returns false if it is invalid; then the
  // caller disconnects.
  bool tryTakeOne();
  bool onLinkState();
  void onAccepted(Link& link);
  struct Times {
    std::uint32_t sentTick;
    std::int64_t timeNs;
  };
  bool tryTakeLong(BodyFields fields, RequestMarks marks, Times times, Request* request);
  void dropReply(BodyFields fields, Request* request);
  bool tryDeliver(Message&& message, std::uint32_t sentTick, Request* request);
  void endRequest(Request& request);
  // Tells tools how many requests have had a reply or a fate.
  void showAnswered() noexcept {
    channel().link().control().clientAnswered.store(sender_.requests()->answered(),
                                                    std::memory_order_relaxed);
  }
  enum class Control { deliver, keep, invalid };
  Control prepareControl(Message& message, Request* request);
  void noteTimes(std::uint32_t sentTick, const Request* request) noexcept;
  void deliver(Message&& message);
  void deliverValues(const Message& first);
  bool tryDeliverRun(const Message& first);
  void takeFurtherReplies(const Message& first, ValueRun& run) noexcept;
  void takeFirstReplies(const Message& first, ValueRun& run) noexcept;
  template <class Run, class Accept>
  void takeRun(Run& run, std::size_t most, const Accept& accept) noexcept;
  bool tryEndRequest(const EnvelopeWords& reply) noexcept;
  // Whether a request of the table was sent. Another thread may have added it and not sent it yet,
  // and take it back when the queue is full: then a reply to it is forged.
  [[nodiscard, gnu::always_inline]] bool isSent(const Request& request) noexcept {
    const auto ordinal = request.ordinal();
    if (ordinal > sentSeen_) [[likely]]
      sentSeen_ = channel().link().outgoing().countedMessages();
    return ordinal <= sentSeen_ || isSentAtLast(request);
  }
  [[nodiscard]] bool isSentAtLast(const Request& request) noexcept;
  // Whether a request is pending: it has had neither a reply nor a fate.
  [[nodiscard]] bool isAwaited(std::uint32_t requestId) noexcept {
    const auto* const request = sender_.requests()->find(requestId);
    return request != nullptr && !request->isGivenUp;
  }
  void deliverConnect(ConnectStatus status);
  void deliverFate(Request& request, Fate fate);
  void deliverFate(const UntakenRequest& request, Fate fate);
  void postFullReport();
  void resumeEnd();
  void endAll();
  void deliverRemaining(const MessageLink* ended);
  void lookForServer(Ending ending);
  void sendUntaken();
  void expire(std::int64_t nowNs);
  void expireUntaken(std::int64_t nowNs);
  void nudge(std::int64_t nowNs);

  DispatcherParts& parts_;
  MessageClient::Callback callback_;
  // Written by the dispatcher's thread under the sender's lock; the first change is that of bind().
  std::atomic<BindingState> state_{BindingState::unbound};
  BindingTimer timer_{parts_.timer, this};
  RequestSender sender_{state_, control(), timer_, [this] { postFullReport(); }};
  Connector connector_{parts_, timer_};
  NudgeInterval nudgeInterval_;
  bool isPaused_ = false;
  bool lacksResources_ = false;
  ValueHandler values_;  // written before bind()
  RunReceiver* runs_ = nullptr;  // likewise; nullptr: all replies are delivered one by one
  // Messages of a run, without its first one, that takeSome() has still to count.
  int takenBehind_ = 0;
  std::uint64_t sentSeen_ = 0;  // messages that were sent on the link, when isSent() looked last
  End end_;  // in the states ending and interrupted, and at the end in the state left
};

}  // namespace mpf
