// SPDX-License-Identifier: MIT
// Proxy: a server elsewhere, as a server of this backplane.
//
//   local client ─► MessageServer(name, location) ─► Line      one client of the far server for each one here
//   local client ◄── held while it does not take ◄── Line
//
// Threads  that of the event loop.
// Crash    when the far server is gone, each request gets its end from there, or was never taken;
//          when the line is gone, requests that never reached it end as neverTaken, and the local
//          clients find the others' ends as they do with any server that ended: outcomeUnknown.
// Trust    a reply to what was not asked, or beyond the window, is the peer's mistake:
//          ProtocolError. So what is held for a client that does not take is bounded.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include <mpf/message_server.h>

#include "router/alarm.h"
#include "router/outgoing/pending_binds.h"
#include "router/readable.h"
#include "router/surroundings.h"
#include "router/transport/line.h"

namespace mpf::router {

class Proxy {
 public:
  // What a proxy wants of the connection that it belongs to.
  class Owner {
   public:
    virtual Line& line() = 0;
    // A number for a client of the far server; nullopt: it has as many clients as it takes.
    virtual std::optional<std::uint32_t> tryNewClient(Proxy& proxy) = 0;
    virtual void dropClient(std::uint32_t number) = 0;
    virtual PeerRecord& record() = 0;
    virtual const Log& log() = 0;  // of the connection

   protected:
    ~Owner() = default;
  };

  // What the far side said of the server.
  struct Offer {
    std::uint32_t binding = 0;
    std::uint64_t incarnation = 0;
    std::uint32_t queueSize = 0;
    std::uint64_t maxMessageBytes = 0;
  };

  //   throws  NameInUse and whatever else a MessageServer's constructor throws
  Proxy(Surroundings& here, Owner& owner, const ServerName& name, const Offer& offer);
  ~Proxy();

  // Takes requests for as long as the line has room, at most `most`. False: there is none left to
  // take.
  bool pump(int most);
  [[nodiscard]] bool hasMore() const noexcept { return hasMore_; }
  // From the far server, to client `number`.
  void reply(std::uint32_t number, wire::Reply::Reader reply);
  void endRequest(std::uint32_t number, std::uint32_t requestId, Fate fate, const std::string& why);
  void queueFull(std::uint32_t number);
  void refuse(std::uint32_t number, const std::string& why);

  // The far server is gone: no more requests are taken, and those without an end have this one.
  // Afterwards, once every reply and fate has been delivered or that took too long, isDone().
  void drain(Fate fate);
  [[nodiscard]] bool isDraining() const noexcept { return !drainUntil_.isNever(); }
  [[nodiscard]] bool isDone() const noexcept;
  [[nodiscard]] bool hasClients() const noexcept { return !clients_.empty(); }

 private:
  struct Held {
    std::uint32_t requestId;
    Message message;
  };
  struct Client {
    std::uint64_t local = 0;  // as MessageServer calls it
    std::uint32_t owed = 0;  // requests without an end
    std::uint32_t window = 0;  // as it was opened
    std::uint64_t unpaid = 0;  // bytes of replies that the far side was given no credit for
    std::uint32_t taken = 0;  // those of them that it took
    bool heldQueueFull = false;  // such news is among what is held
    std::deque<Held> held;  // replies that it has no room for
    std::optional<std::string> refusal;  // why the far server does not have it
    Deadline openAgain = Deadline::never();  // when it may be opened anew, after a refusal
  };
  void onReadable();
  void onClient(std::uint64_t local, bool isThere);
  bool tryOpen(std::uint64_t local);
  void close(std::uint32_t number);
  void loseReply(std::uint32_t number, wire::Reply::Reader reply, const std::string& why);
  void forward(Message request);
  void deliver(std::uint32_t number, Client& client, std::uint32_t requestId, Message&& message);
  bool tryDeliver(std::uint32_t number, Client& client, std::uint32_t requestId, Message& message);
  void giveCredit(std::uint32_t number, Client& client, std::size_t bytes);
  [[nodiscard]] bool awaits(const Client& client, std::uint32_t requestId) const noexcept;
  void end(std::uint32_t number, std::uint32_t requestId, Fate fate);
  void ended(Client& client) noexcept;
  void retryHeld();

  Surroundings& here_;
  Owner& owner_;
  ServerName name_;
  Offer offer_;
  std::unordered_map<std::uint32_t, Client> clients_;  // by number
  // of local clients; 0: the far side has no place for it
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
  Log log_;
  std::uint64_t owed_ = 0;
  bool hasMore_ = true;  // requests may wait that were not taken: else we are told of the next
  Deadline drainUntil_ = Deadline::never();  // not never: it is draining
  std::chrono::milliseconds retryAfter_{};
  Alarm retry_;
  MessageServer server_;
  Alarm again_;
  std::unique_ptr<Readable> readable_;
};

}  // namespace mpf::router
