// SPDX-License-Identifier: MIT
// ServerCore: the links of a MessageServer: accepts clients, receives requests, sends replies,
// closes connections.
//
// Threads  as MessageServer: one thread owns it, any thread may reply.
// Crash    ServerCore closes the links of a dead client and removes their names.
// Trust    invalid data from a client closes its link.
#pragma once

#include <atomic>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <mpf/message.h>
#include <mpf/message_server.h>

#include "server/connection.h"
#include "shm/endpoint.h"

namespace mpf {

class ServerCore {
 public:
  ServerCore(const Backplane& backplane, const std::string& name, const ServerOptions& options);
  ~ServerCore();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::int32_t location() const noexcept { return location_; }
  void setQueueSize(int size);

  bool wait(Deadline deadline);
  Message receive();
  void interrupt() noexcept;
  // Whether the next wait() returns immediately.
  [[nodiscard]] bool isInterrupted() const noexcept {
    return stop_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t clientOf(const Message& request) const noexcept;
  [[nodiscard]] bool isAwaited(const Message& request) const noexcept;
  // Removes the request that was received last from the window: it has been handled, or was kept.
  void endHandling() noexcept;
  ReplyResult reply(Message& message) noexcept;
  BodyBytes allocate(const Route& route, std::size_t bytes);
  void onClient(std::function<void(std::uint64_t, bool)> callback) {
    onClient_ = std::move(callback);
  }
  [[nodiscard]] Deadline takeBefore() const noexcept { return takeBefore_; }
  // Returns a route with link 0 when no client ever had that number.
  [[nodiscard]] Route routeTo(std::uint64_t client, std::uint32_t requestId) const noexcept;
  [[nodiscard]] bool owes(std::uint64_t client, std::uint32_t requestId) const noexcept;
  [[nodiscard]] std::vector<std::uint32_t> owed(std::uint64_t client) const;
  int descriptor();
  // Keeps the descriptor readable, for requests that were not received yet.
  void keepReadable() noexcept;
  void onShortage(std::function<void(const std::string&)> callback) {
    onShortage_ = std::move(callback);
  }
  void countAlarm() noexcept { endpoint_.control().alarms.fetch_add(1, std::memory_order_relaxed); }

  struct Counts {
    std::uint32_t queueSize;
    std::uint64_t inQueue, requests, queueFull, replies;
  };
  [[nodiscard]] Counts counts() const;

  // Ends a request whose handle was destroyed without a reply, with the fate `refused`.
  void abandoned(const Route& route) noexcept;

 private:
  class Keeper;  // NOLINT(cppcoreguidelines-virtual-class-destructor): never destroyed
  static Connection& connectionOf(const Route& route) noexcept {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): only ServerCore interprets a route
    return *reinterpret_cast<Connection*>(route.link);
  }
  static std::uint64_t nameOf(const Connection& connection) noexcept {
    return std::uint64_t{connection.index + 1} << 32 | connection.generation;
  }
  void handleControlEvents();
  void accept(std::uint64_t incarnation);
  void acceptAll();
  void open(std::unique_ptr<Link> link, std::shared_ptr<PeerWindow> client);
  void close(Connection& connection) noexcept;
  void closeDead();
  void closeAll() noexcept;
  void removeLinkOfDead(const Connection& connection) noexcept;
  void removeLink(const std::string& name, std::uint64_t incarnation) noexcept;
  void noteShortage(layout::Shortage shortage, const std::string& why);
  void closeIfClientDid(Connection& connection) noexcept;
  void reportClient(std::uint64_t client, bool isConnected) noexcept;
  void throwNext();
  bool take(Connection& connection, Message& message) noexcept;
  bool hasExpired(const Envelope& envelope) noexcept;
  void noteTimes(Connection& connection, const Envelope& envelope) noexcept;
  void noteProgress(std::int64_t nowNs) noexcept;
  void beginHandling(const Message& request) noexcept;
  ReplyResult sendReply(Connection& connection, Message& message) noexcept;
  void sendFate(Connection& connection, std::uint32_t requestId, std::int32_t clientType,
                std::int32_t clientExtra, Fate fate) noexcept;

  std::string name_;
  std::int32_t location_;
  Endpoint endpoint_;
  Keeper* keeper_;
  std::vector<Connection::Pointer> connections_;  // by index in the window
  std::map<std::uint64_t, Connection*> byLink_;
  std::function<void(std::uint64_t, bool)> onClient_;
  std::deque<std::exception_ptr> thrown_;  // by onClient_; receive() throws them, one each time
  std::function<void(const std::string&)> onShortage_;
  std::int64_t rescanFromNs_ = 0;  // no search for links by name before this time
  bool rescanDue_ = false;
  Deadline takeBefore_ = Deadline::never();  // of the request received last
  bool isHandling_ = false;  // the window shows a request
  bool isSlow_ = false;  // requests take so long that reading the clock for each costs little
  std::int64_t progressAtNs_ = 0;  // when the clock was read last
  std::uint64_t progressAt_ = 0;  // number of requests received until then
  std::atomic<bool> stop_{false};
  bool hasDescriptor_ = false;
};

}  // namespace mpf
