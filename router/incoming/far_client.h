// SPDX-License-Identifier: MIT
// FarClient: a client on another host, as a client of a server on this one.
//
//   Line ─► held until the server has accepted it ─► MessageClient        Line ◄── while its window lasts ◄── MessageClient
//
// Threads  that of the event loop, which runs the Dispatcher, too.
// Crash    the fates that MessageClient tells when the server is gone go on to the far client.
// Trust    until the server has accepted it, a far client holds no more here than the server's
//          queue would, and the clients of a connection not more than so many bytes; replies that
//          wait for credit stay in the link.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include <mpf/message_client.h>

#include "router/alarm.h"
#include "router/surroundings.h"
#include "router/transport/line.h"

namespace mpf::router {

class FarClient {
 public:
  class Owner {
   public:
    virtual Line& line() = 0;
    virtual PeerRecord& record() = 0;
    // Bytes that the clients of this connection hold.
    virtual std::size_t& heldBytes() = 0;
    // Tells its peer that it is not had, and why.
    virtual void refuseClient(std::uint32_t number, const std::string& why) = 0;
    // The server has accepted it.
    virtual void onConnected(FarClient& client) = 0;
    // The server is gone, or it closed this client's link; nothing is owed to it any more. Called
    // from its callback: do not destroy it.
    virtual void onDisconnected(FarClient& client) = 0;

   protected:
    ~Owner() = default;
  };

  struct Terms {
    std::uint32_t number = 0;
    std::uint32_t binding = 0;
    // the life of the server that it is a client of; it is none of any other
    std::uint64_t incarnation = 0;
    std::uint32_t queueSize = 0;  // that server's
    std::uint32_t window = 0;  // bytes of replies that may be on their way
  };
  FarClient(Surroundings& here, Owner& owner, Dispatcher& dispatcher, const Terms& terms);
  ~FarClient();
  FarClient(const FarClient&) = delete;
  FarClient& operator=(const FarClient&) = delete;

  void bind(const std::string& server, std::int32_t location) { client_->bind(server, location); }
  void request(wire::Request::Reader request);
  void credit(std::uint32_t bytes);
  // The server has gone: it hears so now, of that and of what it still had sent.
  void hearOfEnd();
  // No more can come of it: what it holds and what still comes ends so.
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
  void onNews(const Connect& news);
  void send(Waiting waiting);
  void hold(Waiting waiting);
  void letGo(std::size_t bytes) noexcept;
  void expire();
  void tellQueueFull();
  void endRequest(std::uint32_t requestId, Fate fate, const std::string& why);

  Surroundings& here_;
  Owner& owner_;
  Terms terms_;
  std::int64_t window_;  // bytes of replies that may yet be sent
  std::int64_t fullWindow_;
  bool connected_ = false;
  bool serverEnds_ = false;  // what is left of it is taken, whatever the window
  std::optional<Fate> gaveUp_;
  std::string gaveUpBecause_;
  std::deque<Waiting> waiting_;
  std::size_t waitingBytes_ = 0;
  bool fullTold_ = false;  // this run of refusals of waiting requests
  Alarm expiry_;
  std::unique_ptr<MessageClient> client_;  // until it gives up
};

}  // namespace mpf::router
