// SPDX-License-Identifier: MIT
// FarClient: represents a client of another host as a client of a server on this one.
//
//   Line ─► held until the server accepts the client ─► MessageClient
//   Line ◄── as long as the window has room ◄── MessageClient
//
// Threads  that of the event loop, which also runs the Dispatcher.
// Crash    when the server exits, the fates that MessageClient delivers are sent to the far client.
// Trust    until the server accepts the client, at most as many requests are held as the server's
//          queue would hold, and at most kMaxHeld bytes for a client and kMaxHeldOfAll for all
//          clients of a connection. Replies that wait for credit stay in the link.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include <mpf/message_client.h>

#include "client/relay_client.h"
#include "router/alarm.h"
#include "router/router_context.h"
#include "router/transport/line.h"

namespace mpf::router {

class FarClient {
 public:
  class Owner {
   public:
    virtual Line& line() = 0;
    virtual PeerRecord& record() = 0;
    // Bytes of the requests that all clients of this connection hold.
    virtual std::size_t& heldBytes() = 0;
    // Reports to the peer that the server does not accept this client, and why.
    virtual void refuseClient(std::uint32_t number, const std::string& why) = 0;
    // The server has accepted it.
    virtual void onConnected(FarClient& client) = 0;
    // The server is gone, or it has closed this client's link; all requests have ended. Called from
    // the client's callback: do not destroy the client.
    virtual void onDisconnected(FarClient& client) = 0;

   protected:
    ~Owner() = default;
  };

  struct Terms {
    std::uint32_t number = 0;
    std::uint32_t binding = 0;
    std::uint64_t incarnation = 0;  // of the server; requests never go to another incarnation
    std::uint32_t queueSize = 0;  // of the server
    std::uint32_t window = 0;  // bytes of replies that may be on their way
  };
  FarClient(RouterContext& context, Owner& owner, Dispatcher& dispatcher, const Terms& terms);
  ~FarClient();
  FarClient(const FarClient&) = delete;
  FarClient& operator=(const FarClient&) = delete;

  void bind(const std::string& server, std::int32_t location) { client_->bind(server, location); }
  void request(wire::Request::Reader request);
  void credit(std::uint32_t bytes);
  // The server is gone: receives the messages that it had sent, regardless of the window, and then
  // the disconnect.
  void onServerGone();
  // Ends all held requests, and those that arrive later, with `fate`.
  void giveUp(Fate fate, const std::string& why);

  [[nodiscard]] std::uint32_t binding() const noexcept { return terms_.binding; }
  [[nodiscard]] bool isConnected() const noexcept { return connected_; }

 private:
  struct Waiting {
    std::uint32_t requestId;
    Deadline takeBefore;
    Message message;
    [[nodiscard]] std::size_t bytes() const noexcept {
      return sizeof(Waiting) + message.body().size();
    }
  };
  void onMessage(Message&& message);
  void onConnect(const Connect& connect);
  void send(Waiting waiting);
  void hold(Waiting waiting);
  void releaseHeld(std::size_t bytes) noexcept;
  void expire();
  void sendQueueFull();
  void endRequest(std::uint32_t requestId, Fate fate, const std::string& why);

  RouterContext& context_;
  Owner& owner_;
  Terms terms_;
  std::int64_t window_;  // bytes of replies that may be sent before the next credit
  std::int64_t fullWindow_;
  bool connected_ = false;
  bool serverGone_ = false;  // its remaining messages are received regardless of the window
  std::optional<Fate> gaveUp_;  // set by giveUp()
  std::string giveUpReason_;
  std::deque<Waiting> waiting_;
  std::size_t waitingBytes_ = 0;
  bool queueFullSent_ = false;  // in this run of refused requests
  Alarm expiry_;
  std::unique_ptr<RelayClient> client_;  // nullptr after giveUp()
};

}  // namespace mpf::router
