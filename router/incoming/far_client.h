// SPDX-License-Identifier: MIT
// FarClient: represents a client of another host as a client of a server on this one.
//
//   Line ─► held until the server accepts the client ─► MessageClient
//   Line ◄── as long as the window has room ◄── MessageClient
//
// States:
//   waiting ─ the server accepts it ─► connected ─ onServerGone() ─► draining
//   connected, draining ─ disconnected ─► waiting
//   waiting ─ refused, or giveUp() ─► gaveUp
//
// Threads  that of the event loop, which also runs the Dispatcher.
// Crash    when the server exits, the fates that MessageClient delivers are sent to the far client.
// Trust    requests that wait for the server are limited by HeldRequests. Replies that wait for
//          credit stay in the link.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <mpf/message_client.h>

#include "client/relay_client.h"
#include "router/alarm.h"
#include "router/incoming/held_requests.h"
#include "router/statistics.h"
#include "router/transport/line.h"

namespace mpf::router {

class FarClient final : private RunReceiver {
 public:
  // What a client reports to the object that made it.
  struct Events {
    // The server has accepted it.
    std::function<void(FarClient& client)> onConnected;
    // The server is gone, or it has closed this client's link; all requests have ended. Called from
    // the client's callback: do not destroy the client.
    std::function<void(FarClient& client)> onDisconnected;
    // The server does not accept it, for the reason `why`. As for onDisconnected.
    std::function<void(FarClient& client, const std::string& why)> onRefused;
  };
  // What the clients of a connection share.
  struct Shared {
    kj::Timer& timer;
    Dispatcher& dispatcher;
    Line& line;
    PeerRecord& record;
    std::size_t& heldBytes;  // of the requests that all clients hold
    const Events& events;
  };
  struct Terms {
    std::uint32_t number = 0;
    std::uint32_t binding = 0;
    std::uint64_t incarnation = 0;  // of the server; requests never go to another incarnation
    std::uint32_t queueSize = 0;  // of the server
    std::uint32_t window = 0;  // bytes of replies that may be on their way; at least 1
  };
  // `shared` and what it refers to outlive this object.
  FarClient(const Shared& shared, const Terms& terms);
  FarClient(const FarClient&) = delete;
  FarClient& operator=(const FarClient&) = delete;

  //   throws  std::runtime_error when this process has no descriptor, memory or thread for it
  void bind(const std::string& server, std::int32_t location);
  //   throws  ProtocolError
  void request(wire::Request::Reader request);
  void request(PlainItem& item);
  void request(const PlainItems& items);
  void credit(std::uint32_t bytes);
  // The server is gone: receives the messages that it had sent, drops those beyond the window, and
  // then receives the disconnect.
  void onServerGone();
  // Ends all held requests, and those that arrive later, with `fate`.
  void giveUp(Fate fate, const std::string& why);

  [[nodiscard]] std::uint32_t number() const noexcept { return terms_.number; }
  [[nodiscard]] std::uint32_t binding() const noexcept { return terms_.binding; }
  [[nodiscard]] bool isConnected() const noexcept {
    return state_ == State::connected || state_ == State::draining;
  }

 private:
  enum class State : std::uint8_t {
    waiting,  // requests are held
    connected,  // requests go to the server
    draining,  // the server is gone: the messages that it had sent are received
    gaveUp,  // requests end with fateAfterGiveUp_
  };
  void onMessage(Message&& message);
  [[nodiscard]] std::size_t room() const noexcept override;
  void onRun(const MessageRun& run, bool isFirst) override;
  void useWindow(std::int64_t bytes);
  void drop(std::uint32_t requestId, bool isFirst, std::uint32_t missed);
  [[nodiscard]] std::uint32_t takeDropped(std::uint32_t requestId);
  void onConnect(const Connect& connect);
  void accept();
  void send(HeldRequest request);
  void send(std::uint32_t requestId, Message& message, Deadline takeBefore);
  void hold(HeldRequest request);
  void expire();
  void expireAt(Deadline deadline);
  void sendQueueFull();
  void endRequest(std::uint32_t requestId, Fate fate, const std::string& why);

  struct Dropped {
    std::uint32_t requestId;
    std::uint32_t count;
  };

  const Shared& shared_;
  Terms terms_;
  State state_ = State::waiting;
  bool queueFullSent_ = false;  // in this series of refused requests
  Fate fateAfterGiveUp_{};
  std::int64_t window_;  // bytes of replies that may be sent before the next credit
  std::string giveUpReason_;
  HeldRequests held_;
  std::vector<Dropped> dropped_;  // further replies of which the far client has not been told
  std::unique_ptr<Alarm> expiry_;  // once a request with a deadline was held
  std::optional<RelayClient> client_;  // empty after giveUp()
};
// A router has one for each remote client.
static_assert(sizeof(FarClient) <= 224);

}  // namespace mpf::router
