// SPDX-License-Identifier: MIT
#include "router/router.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <map>
#include <system_error>
#include <utility>

#include "router/transport/kj_text.h"

namespace mpf::router {
namespace {

// The delay before pending binds are read: binds of many clients that start at once are read
// together.
constexpr auto kPendingBindsDelay = std::chrono::milliseconds(5);
constexpr auto kPendingBindsRetryDelay = std::chrono::seconds(1);  // when not all could be read

}  // namespace

Router::Router(kj::AsyncIoContext& io, const RouterConfig& config, const Log& log)
    : statistics_(Backplane::attach(config.backplane), config.name),
      context_{.port = io.unixEventPort,
               .network = io.provider->getNetwork(),
               .timer = io.provider->getTimer(),
               .backplane = Backplane::attach(config.backplane),
               .log = log,
               .statistics = statistics_,
               .monitors = monitors_,
               .config = config,
               .tls = nullptr,
               .incarnation = segments::newIncarnation(),
               .polling = &polling_},
      polling_(io.unixEventPort, context_.writes),
      monitors_(context_.backplane, io.unixEventPort, [this] { lookAtServers(); }),
      pendingBinds_(context_.backplane),
      bell_(io.unixEventPort, [this] { readPendingBindsSoon(); }),
      pendingBindsDue_(context_.timer, [this] { readPendingBinds(); }),
      refusedPeers_(context_.timer),
      tasks_(*this) {
  openTls(config);
  names_ = context_.backplane.watcher().watchNames(NameKind::pendingBind, [this] { bell_.ring(); });
}

Router::~Router() { context_.backplane.watcher().forget(names_); }

void Router::openTls(const RouterConfig& config) {
  if (!config.tls.certificate.empty())
    context_.tls = std::make_shared<Tls>(config.tls, context_.timer, config.limits.handshakeTime);
}

kj::Promise<void> Router::start() {
  auto starts = kj::Vector<kj::Promise<void>>();
  for (const auto& each : context_.config.listen) starts.add(listen(each).start());
  for (const auto& remote : context_.config.remotes)
    remotes_.push_back(std::make_unique<ClientRouter>(context_, remote));
  readPendingBindsSoon();
  return kj::joinPromises(starts.releaseAsArray());
}

Listener& Router::listen(const Listen& listen) {
  auto onCaller = [this, listen](Listener::Caller caller) {
    this->onCaller(listen, std::move(caller));
  };
  return *listeners_.emplace_back(
      std::make_shared<Listener>(context_, listen, std::move(onCaller)));
}

// Removes a listener that cannot listen; the next reload tries it again. A reload may have removed
// it before its result arrives.
void Router::listenAfterReload(const Listen& listen) {
  auto started = this->listen(listen).start();
  tasks_.add(started.catch_([this, late = std::weak_ptr(listeners_.back())](kj::Exception&& error) {
    const auto listener = late.lock();
    if (!listener) return;
    context_.log.error("{}", toStd(error.getDescription()));
    listeners_.remove(listener);
  }));
}

std::vector<Address> Router::listening() {
  std::vector<Address> addresses;
  for (const auto& listener : listeners_) addresses.push_back(listener->address());
  return addresses;
}

void Router::onCaller(const Listen& listen, Listener::Caller caller) {
  if (sessions_.size() >= context_.config.limits.maxConnections && !tryMakeRoom()) {
    context_.log.warn("{}: rejected: there are already {} connections (max-connections)",
                      caller.address, sessions_.size());
    return refusedPeers_.add(
        kj::mv(caller.stream), FarewellCode::LIMIT,
        fmt::format("this router has {} connections, its limit (max-connections)",
                    sessions_.size()));
  }
  auto end = kj::newPromiseAndFulfiller<void>();
  sessions_.push_back({listen,
                       std::make_unique<ServerRouter>(context_, kj::mv(caller.stream), caller.name,
                                                      caller.address, caller.isTls),
                       hostOf(caller.address), kj::mv(end.fulfiller)});
  const auto session = std::prev(sessions_.end());
  tasks_.add(session->router->run().exclusiveJoin(kj::mv(end.promise)).then([this, session] {
    sessions_.erase(session);
  }));
}

// Closes a connection whose peer has not sent its greeting: the oldest one of the host with the
// most of them. It stays in the list until the event loop has closed it, but is not chosen again.
bool Router::tryMakeRoom() {
  const auto isIdle = [](const Session& session) {
    return session.end && !session.router->hasGreeted();
  };
  std::map<std::string, std::size_t> counts;
  for (const auto& session : sessions_) {
    if (isIdle(session)) ++counts[session.host];
  }
  if (counts.empty()) return false;
  const auto most =
      std::ranges::max_element(counts, {}, [](const auto& each) { return each.second; })->second;
  const auto victim = std::ranges::find_if(sessions_, [&](const Session& session) {
    return isIdle(session) && counts[session.host] == most;
  });
  context_.log.warn(
      "{} connections (max-connections), {} of them from {} without a greeting: closing the oldest "
      "of these",
      sessions_.size(), most, victim->host);
  std::exchange(victim->end, nullptr)->fulfill();
  return true;
}

void Router::lookAtServers() {
  monitors_.lookAtAll();
  for (const auto& session : sessions_) session.router->onServers();
}

void Router::readPendingBindsSoon() { pendingBindsDue_.setAt(Deadline::after(kPendingBindsDelay)); }

void Router::readPendingBinds() {
  std::string problem;
  try {
    const auto pendingBinds = pendingBinds_.look();
    for (const auto& remote : remotes_) remote->setPendingBinds(pendingBinds);
    problem = pendingBinds_.problem();
  } catch (const std::system_error& error) {
    problem = error.what();
  }
  if (!problem.empty()) {
    if (pendingBindProblem_.empty())
      context_.log.warn("cannot read all pending binds of clients of this host, trying again: {}",
                        problem);
    pendingBindsDue_.setAt(Deadline::after(kPendingBindsRetryDelay));
  }
  pendingBindProblem_ = std::move(problem);
}

// Keeps what cannot change while the router runs: tools and peers know its name.
void Router::replaceConfig(const RouterConfig& config) {
  const auto old = std::exchange(context_.config, config);
  context_.config.name = old.name;
  context_.config.backplane = old.backplane;
  if (config.backplane != old.backplane || config.name != old.name)
    context_.log.warn(
        "a new name or backplane takes effect when the router is restarted; the name is still {}",
        old.name);
  context_.log.setLevel(config.logLevel);
}

void Router::reload(const RouterConfig& config) {
  openTls(config);
  replaceConfig(config);
  std::erase_if(listeners_, [&](const auto& listener) {
    return std::ranges::find(config.listen, listener->listen()) == config.listen.end();
  });
  for (const auto& session : sessions_) {
    if (std::ranges::find(config.listen, session.listen) == config.listen.end())
      session.router->stop();
    else session.router->onConfig();
  }
  for (const auto& each : config.listen) {
    if (std::ranges::any_of(listeners_,
                            [&](const auto& listener) { return listener->listen() == each; }))
      continue;
    listenAfterReload(each);
  }
  for (auto remote = remotes_.begin(); remote != remotes_.end();) {
    if (std::ranges::find(config.remotes, (*remote)->remote()) != config.remotes.end()) {
      ++remote;
      continue;
    }
    auto gone = kj::heap(std::move(*remote));
    auto stopped = (*gone)->stop();
    tasks_.add(stopped.attach(kj::mv(gone)));
    remote = remotes_.erase(remote);
  }
  for (const auto& each : config.remotes) {
    if (std::ranges::any_of(remotes_, [&](const auto& remote) { return remote->remote() == each; }))
      continue;
    remotes_.push_back(std::make_unique<ClientRouter>(context_, each));
  }
  readPendingBindsSoon();
}

kj::Promise<void> Router::stop() {
  listeners_.clear();
  auto ends = kj::Vector<kj::Promise<void>>();
  for (const auto& remote : remotes_) ends.add(remote->stop());
  for (const auto& session : sessions_) session.router->stop();
  ends.add(tasks_.onEmpty());
  return kj::joinPromises(ends.releaseAsArray());
}

void Router::taskFailed(kj::Exception&& error) {
  context_.log.error("{}", toStd(error.getDescription()));
}

}  // namespace mpf::router
