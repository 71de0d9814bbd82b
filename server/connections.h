// SPDX-License-Identifier: MIT
// Connections: the connections of a server to its clients: adds, opens, finds and closes them.
//
//   add ─► open ─► close: the client has closed the link, died or sent invalid data, or the server
//                         ends
//
// Threads  the server's thread; clientOf() and isConnected() any.
// Crash    closes the links of a dead client and removes their names.
// Trust    a client affects only its own connection.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include <mpf/message.h>

#include "server/connection.h"
#include "shm/endpoint.h"

namespace mpf {

class Connections {
 public:
  explicit Connections(Endpoint& endpoint) noexcept : endpoint_(endpoint) {}

  // MessageServer::onClient().
  void onClient(std::function<void(std::uint64_t client, bool isConnected)> callback) {
    onClient_ = std::move(callback);
  }
  // An exception of that callback must not interrupt a change of the connections: it is kept until
  // throwNext() throws it.
  [[nodiscard]] bool hasThrown() const noexcept { return !thrown_.empty(); }
  [[noreturn]] void throwNext();

  // Adds a connection at a reserved index of the endpoint; frees the index when it throws.
  //   throws  std::bad_alloc
  Connection& add(std::uint32_t index, std::unique_ptr<Link> link);
  // Tells the client that its link is accepted; from now on its messages are received.
  void open(Connection& connection);
  void close(Connection& connection) noexcept;
  // Closes a connection without a message, if its client has closed the link.
  void closeIfClientClosed(Connection& connection) noexcept;
  void closeDead() noexcept;
  // Closes all. Returns the links of the clients that may still have to receive replies from the
  // server's pools, and cannot do so when the link and the fan-out pool no longer exist.
  using Channels = std::vector<std::shared_ptr<MessageLink>>;
  [[nodiscard]] Channels closeAll() noexcept;
  // Gives these clients a moment to receive the replies.
  static void drain(const Channels& channels) noexcept;

  // By index in the endpoint. All objects exist; `channel` of one without a client is empty.
  [[nodiscard]] const std::vector<Connection::Pointer>& all() const noexcept { return all_; }
  // Whether there is a connection for the link with this incarnation.
  [[nodiscard]] bool contains(std::uint64_t link) const { return byLink_.contains(link); }

  // The number of the client that sent a request; 0 if it has disconnected.
  [[nodiscard]] static std::uint64_t clientOf(const Route& request) noexcept;
  // Whether that client is connected and alive.
  [[nodiscard]] static bool isConnected(const Route& request) noexcept;
  // The route to a client, of no request or of the request with this id; its link is 0 when no
  // client ever had that number.
  [[nodiscard]] Route routeTo(std::uint64_t client) const noexcept;
  [[nodiscard]] Route routeTo(std::uint64_t client, std::uint32_t requestId) const noexcept;
  // Whether a request that was received has no reply; all such requests of a client.
  [[nodiscard]] bool isUnanswered(std::uint64_t client, std::uint32_t requestId) const noexcept;
  [[nodiscard]] std::vector<std::uint32_t> unanswered(std::uint64_t client) const;

 private:
  void reportClient(std::uint64_t client, bool isConnected) noexcept;
  void removeFilesOf(const Link& link) noexcept;
  void removeClientOf(const Link& link) noexcept;

  Endpoint& endpoint_;
  std::vector<Connection::Pointer> all_;
  std::map<std::uint64_t, Connection*> byLink_;  // the open ones
  std::function<void(std::uint64_t, bool)> onClient_;
  std::vector<std::exception_ptr> thrown_;  // the oldest first
};

}  // namespace mpf
