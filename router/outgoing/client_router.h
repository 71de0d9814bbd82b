// SPDX-License-Identifier: MIT
// ClientRouter: the clients of this host, at one remote router ("RMRClient" in the manual's
// report).
//
//   waiting ─time─► connecting ─greeted─► connected ─line ends─► waiting (longer each time, jittered)
//
//   pending binds ─► bind ─► the far side says "there" ─► Proxy ... "absent" ─► drained, gone
//
// Threads  that of the event loop.
// Crash    whatever ends the line ends the proxies: their clients are disconnected, pending bind
//          again, and are bound again when it is back.
#pragma once

#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "router/fatal_tasks.h"
#include "router/outgoing/proxy.h"

namespace mpf::router {

class ClientRouter final : public Line::Owner, public Proxy::Owner {
 public:
  ClientRouter(Surroundings& here, const Remote& remote);
  ~ClientRouter();

  [[nodiscard]] const Remote& remote() const noexcept { return remote_; }
  // What the clients of this host wait for now, at any location.
  void setPendingBinds(const std::set<ServerName>& pendingBinds);
  // Says farewell; afterwards the promise is done.
  [[nodiscard]] kj::Promise<void> stop();

 private:
  struct Wanted {
    std::uint32_t binding = 0;  // 0: the far side was not told yet
    std::unique_ptr<Proxy> proxy;
    std::optional<Proxy::Offer> offer;  // that has no proxy yet: somebody else has its name here
    std::string problem;  // of making it, that was logged last
    std::int64_t bindAgainNs = 0;  // after the far side refused it
    std::int64_t idleSinceNs = 0;  // 0: it is wished for or used
  };
  kj::Promise<void> connectLoop();
  kj::Promise<LineEnd> runOnce();
  kj::Promise<kj::Own<kj::AsyncIoStream>> connect();
  kj::Promise<kj::Own<kj::AsyncIoStream>> connectToOne(std::vector<std::string> addresses);
  kj::Promise<kj::Own<kj::AsyncIoStream>> connectTo(const std::string& address);
  // Each step of connecting may take the dead time. An error names the step.
  template <class T>
  kj::Promise<T> within(const std::string& step, kj::Promise<T> promise) {
    return here_.timer.timeoutAfter(toKj(here_.config.limits.deadTime), kj::mv(promise))
        .catch_(
            [this, step](kj::Exception&& error) -> kj::Promise<T> { return failed(step, error); });
  }
  [[nodiscard]] kj::Exception failed(const std::string& step, const kj::Exception& error) const;
  [[nodiscard]] kj::Duration nextDelay();
  void onLineEnd(const std::string& why);
  void bindWanted();
  void bind(const ServerName& name, Wanted& wanted);
  void makeProxy(const ServerName& name, Wanted& wanted);
  void onServer(wire::Server::Reader server);
  void onRefusal(const ServerName& name, Wanted& wanted, const std::string& why);
  void sweep();
  [[nodiscard]] bool isPending(const Wanted& wanted) const;
  void sweepSoon();

  // Line::Owner
  void onGreeting(const PeerGreeting& greeting) override;
  void onItem(wire::Item::Reader item) override;
  void onRoom() override;
  void onUnsendable(const Carried& carried, const std::string& why,
                    wire::Item::Builder instead) override;
  // Proxy::Owner
  Line& line() override { return *line_; }
  std::optional<std::uint32_t> tryNewClient(Proxy& proxy) override;
  void dropClient(std::uint32_t number) override;
  PeerRecord& record() override { return *record_; }
  const Log& log() override { return log_; }
  Proxy* proxyOf(std::uint32_t client);
  Proxy* openedProxyOf(std::uint32_t client);

  Surroundings& here_;
  Remote remote_;
  std::shared_ptr<PeerRecord> record_;
  std::unique_ptr<Line> line_;
  bool connected_ = false;
  bool stopping_ = false;
  std::string problem_;  // that was logged last
  std::map<ServerName, Wanted> wanted_;
  std::unordered_map<std::uint32_t, ServerName> bindings_;
  std::unordered_map<std::uint32_t, Proxy*> clients_;
  std::uint32_t lastBinding_ = 0;
  std::uint32_t lastClient_ = 0;
  bool saidFull_ = false;
  Log log_;
  std::chrono::milliseconds retry_{};
  std::int64_t connectedNs_ = 0;
  ServerName pumped_;  // the last one whose requests had their turn
  Alarm pumpAgain_;
  std::minstd_rand random_{std::random_device{}()};
  Alarm sweeps_;
  kj::ForkedPromise<void> loop_ = nullptr;
  FatalTasks tasks_;
};

}  // namespace mpf::router
