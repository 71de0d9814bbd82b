// SPDX-License-Identifier: MIT
// FarClients: the clients of one accepted connection, and the dispatcher that runs them.
//
// Each connection has its own dispatcher, which does not run while the line has no room. The queues
// of its clients then fill up, and other connections are not affected.
//
// Threads  that of the event loop.
// Trust    a peer that opens more than Limits::maxClients clients, uses a number twice, or names a
//          client that was never opened commits a ProtocolError.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/relay_dispatcher.h"
#include "router/alarm.h"
#include "router/incoming/far_client.h"
#include "router/polling.h"
#include "router/readable.h"
#include "router/router_context.h"
#include "router/server_name.h"

namespace mpf::router {

class FarClients final : private Polled {
 public:
  // `context`, `line` and `record` outlive this object.
  FarClients(RouterContext& context, Line& line, PeerRecord& record, FarClient::Events events);
  ~FarClients() { context_.endPolling(*this); }

  // The peer opens a client of this number.
  //   throws  ProtocolError
  void open(std::uint32_t number);
  // Creates an opened client, and binds it to a server of this host.
  //   throws  std::exception: no memory or no file descriptor is left
  void add(const FarClient::Terms& terms, const ServerName& server);
  // The client of a number that the peer has sent; nullptr: it does not exist any more.
  //   throws  ProtocolError: the client was never opened (find() only)
  [[nodiscard]] FarClient* find(std::uint32_t number) const;
  [[nodiscard]] FarClient* tryFind(std::uint32_t number) const noexcept;

  // Destroy one client, or those of a binding. Do not call these from the callback of a client.
  void remove(std::uint32_t number);
  void removeAllOf(std::uint32_t binding);
  // As removeAllOf(), also from the callback of a client: destroys them when it has returned.
  void dropAllOf(std::uint32_t binding);
  void forEachOf(std::uint32_t binding, const std::function<void(FarClient&)>& act) const;

  // Receives messages of the servers while the line has room.
  void run();
  // A frame has arrived, or frames are sent: messages of the servers may follow.
  void onTraffic();

 private:
  void poll() override { run(); }
  void setPolled(bool isPolled) override { dispatcher_->setPolled(isPolled); }
  void startDispatcher();
  void scheduleRun();
  // Clients were added or removed.
  void noteClients() noexcept;

  RouterContext& context_;
  Line& line_;
  PeerRecord& record_;
  FarClient::Events events_;
  std::size_t heldBytes_ = 0;  // of the requests that all clients hold
  std::unique_ptr<RelayDispatcher> dispatcher_;  // created with the first client
  std::unique_ptr<Readable> readable_;
  std::optional<FarClient::Shared> shared_;  // likewise; outlives the clients
  std::unordered_map<std::uint32_t, std::unique_ptr<FarClient>> clients_;
  // The client of the last item, so that a run of them costs one look-up.
  mutable std::pair<std::uint32_t, FarClient*> recent_{};
  std::uint32_t lastClient_ = 0;
  std::vector<std::unique_ptr<FarClient>> dropped_;  // destroyed by the next run()
  Alarm timer_;
};

}  // namespace mpf::router
