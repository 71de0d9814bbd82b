// SPDX-License-Identifier: MIT
// Proxy: represents a server of another host as a server on this backplane.
//
//   local client ─► MessageServer(name, location) ─► Line     one far client for each local client
//   local client ◄── held while the client's queue is full ◄── Line
//
// States:
//   ready ─ no request is left ─► idle ─ the next one arrives ─► ready
//   ready, idle ─ the far server is gone: drain() ─► draining
//
// Threads  that of the event loop.
// Crash    when the far server exits, the peer sends the fate of each request that it received; the
//          others end as neverTaken. When the line ends, requests that were never written to it end
//          as neverTaken; the others end at the local clients as outcomeUnknown, as with any server
//          that exits.
// Trust    a reply that answers no pending request, or that exceeds the window, is a ProtocolError.
//          This bounds the replies that are held for a client that does not receive them.
#pragma once

#include <list>
#include <memory>
#include <string>
#include <unordered_map>

#include <mpf/message_server.h>

#include "router/alarm.h"
#include "router/outgoing/remote_connection.h"
#include "router/outgoing/reply_window.h"
#include "router/polling.h"
#include "router/readable.h"
#include "router/router_context.h"
#include "router/server_name.h"
#include "router/transport/line.h"
#include "server/relay_server.h"

namespace mpf::router {

class Proxy final : private Polled {
 public:
  // The far server, as the peer describes it.
  struct Offer {
    std::uint32_t binding = 0;
    std::uint64_t incarnation = 0;
    std::uint32_t queueSize = 0;
    std::uint64_t maxMessageBytes = 0;
    std::uint32_t hops = 0;  // from the peer to the server
  };

  // `context` and `connection` outlive this object.
  //   throws  as the constructor of MessageServer, for example NameInUse
  Proxy(RouterContext& context, RemoteConnection& connection, const ServerName& name,
        const Offer& offer);
  ~Proxy();

  // Takes requests while the line has room, at most `most`. Returns false when no request is left.
  bool pump(int most);
  // Whether requests may be waiting.
  [[nodiscard]] bool hasMore() const noexcept { return state_ == State::ready; }
  // Hand an item of the far server to client `number`.
  void reply(std::uint32_t number, wire::Reply::Reader reply);
  void reply(PlainItem& item);
  void reply(const PlainItems& items);
  void endRequest(std::uint32_t number, std::uint32_t requestId, Fate fate, const std::string& why);
  void queueFull(std::uint32_t number);
  void refuse(std::uint32_t number, const std::string& why);

  // The far server is gone: takes no more requests and ends all pending ones with `fate`. isDone()
  // becomes true when all replies and fates are delivered, at the latest after Limits::deadTime.
  void drain(Fate fate);
  [[nodiscard]] bool isDraining() const noexcept { return state_ == State::draining; }
  [[nodiscard]] bool isDone() const noexcept;
  // Disconnects the clients. Returns what has to exist for a moment longer, as RelayServer.
  [[nodiscard]] std::shared_ptr<const void> closeAll() { return server_.closeAll(); }
  // Whether local clients are connected, also those that the peer does not accept.
  [[nodiscard]] bool hasClients() const noexcept { return !numbers_.empty(); }

 private:
  enum class State { idle, ready, draining };
  struct Held {
    std::uint32_t requestId;
    Message message;
  };
  struct Refusal {
    std::string why;
    Deadline openAgain;  // when the client may be opened again
  };
  struct Client {
    std::uint32_t number = 0;
    std::uint64_t local = 0;  // its number in MessageServer
    std::uint32_t unanswered = 0;  // requests that have not ended
    ReplyWindow window{0};  // as sent in `open`
    bool heldQueueFull = false;  // `held` contains a connectQueueFull
    std::list<Held> held;  // replies for which the client has no room
    std::unique_ptr<Refusal> refusal;  // if the far server does not accept it
  };
  void poll() override { onReadable(); }
  void setPolled(bool isPolled) override { server_.setPolled(isPolled); }
  void onReadable();
  void onClient(std::uint64_t local, bool isThere);
  bool tryOpen(std::uint64_t local);
  void close(std::uint32_t number);
  void loseReply(std::uint32_t number, wire::Reply::Reader reply, const std::string& why);
  void forward(Message request);
  void forward(std::uint64_t local, const MessageRun& requests);
  Client* tryFindSender(std::uint64_t local);
  Client* tryFindOrOpen(std::uint64_t local);
  Client* tryFind(std::uint32_t number);
  bool checkReply(const Client& client, std::uint32_t requestId, bool isFirst) const;
  void deliver(Client& client, std::uint32_t requestId, Message&& message, bool endsRequest);
  bool tryDeliver(Client& client, std::uint32_t requestId, Message& message, bool endsRequest);
  void giveCredit(Client& client, std::uint64_t bytes);
  [[nodiscard]] bool awaits(const Client& client, std::uint32_t requestId) const noexcept;
  void end(std::uint32_t number, std::uint32_t requestId, Fate fate);
  void ended(Client& client, std::uint32_t requests = 1) noexcept;
  void retryHeld();

  RouterContext& context_;
  RemoteConnection& connection_;
  ServerName name_;
  Offer offer_;
  std::unordered_map<std::uint32_t, Client> clients_;  // by number
  // Numbers of the local clients; 0: the peer has accepted no more clients.
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
  Client* recent_ = nullptr;  // of the last message: a run of messages costs one look-up
  Log log_;
  std::uint64_t unanswered_ = 0;
  State state_ = State::ready;
  Deadline drainUntil_ = Deadline::never();  // set by drain()
  std::chrono::milliseconds retryAfter_{};
  Alarm retry_;
  RelayServer server_;
  Alarm again_;
  std::unique_ptr<Readable> readable_;
  MessageRun run_;  // of requests; used by pump()
};

}  // namespace mpf::router
