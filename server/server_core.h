// SPDX-License-Identifier: MIT
// ServerCore: what MessageServer does with links: accepts them, takes requests, sends replies, ends
// what must end.
//
// Threads  as MessageServer: one owner thread, replies from any.
// Crash    a dead client's links are closed and their names removed, here.
// Trust    nonsense from a client closes its link.
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
  // Whether the next wait() ends at once.
  [[nodiscard]] bool isInterrupted() const noexcept {
    return stop_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t clientOf(const Message& request) const noexcept;
  [[nodiscard]] bool isAwaited(const Message& request) const noexcept;
  // The request received last is done with, or kept for later: the window does not show it any
  // more.
  void endHandling() noexcept;
  ReplyResult reply(Message& message) noexcept;
  BodyBytes allocate(const Route& route, std::size_t bytes);
  void onClient(std::function<void(std::uint64_t, bool)> news) { clientNews_ = std::move(news); }
  [[nodiscard]] Deadline takeBefore() const noexcept { return takeBefore_; }
  // A route with link 0 when the client is gone.
  [[nodiscard]] Route routeTo(std::uint64_t client, std::uint32_t requestId) const noexcept;
  [[nodiscard]] bool owes(std::uint64_t client, std::uint32_t requestId) const noexcept;
  [[nodiscard]] std::vector<std::uint32_t> owed(std::uint64_t client) const;
  int descriptor();
  // Leaves the descriptor readable: not all that there is was received.
  void callAgain() noexcept;
  void onShortage(std::function<void(const std::string&)> tell) { tellShortage_ = std::move(tell); }
  void countAlarm() noexcept { endpoint_.control().alarms.fetch_add(1, std::memory_order_relaxed); }

  struct Counts {
    std::uint32_t queueSize;
    std::uint64_t inQueue, requests, queueFull, replies;
  };
  [[nodiscard]] Counts counts() const;

  // Ends a request whose handle died unanswered.
  void abandoned(const Route& route) noexcept;

 private:
  class Keeper;  // NOLINT(cppcoreguidelines-virtual-class-destructor): never destroyed
  static Connection& connectionOf(const Route& route) noexcept {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): a route is opaque to everybody else
    return *reinterpret_cast<Connection*>(route.link);
  }
  static std::uint64_t nameOf(const Connection& connection) noexcept {
    return std::uint64_t{connection.index + 1} << 32 | connection.generation;
  }
  void lookAround();
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
  void tell(std::uint64_t client, bool isThere) noexcept;
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
  std::function<void(std::uint64_t, bool)> clientNews_;
  std::deque<std::exception_ptr> thrown_;  // by clientNews_; receive() throws them, one each time
  std::function<void(const std::string&)> tellShortage_;
  std::int64_t rescanFromNs_ = 0;  // no look for links by name before
  bool rescanDue_ = false;
  Deadline takeBefore_ = Deadline::never();  // of the request taken last
  bool isHandling_ = false;  // the window shows a request
  bool isSlow_ = false;  // requests take so long that a look at the clock for each costs nothing
  std::int64_t progressAtNs_ = 0;  // the last look at the clock,
  std::uint64_t progressAt_ = 0;  // and the number of requests taken until then
  std::atomic<bool> stop_{false};
  bool hasDescriptor_ = false;
};

}  // namespace mpf
