// SPDX-License-Identifier: MIT
#include "epics/ioc_clients.h"

#include <pthread.h>

#include <drvSup.h>
#include <epicsExport.h>
#include <epicsStdio.h>
#include <errlog.h>
#include <initHooks.h>

#include "base/signals_blocked.h"

namespace mpf {

// Never destroyed: threads of the IOC may use it until the process ends.
IocClients& IocClients::instance() {
  static auto* clients = new IocClients;
  return *clients;
}

namespace {
void onInitHook(initHookState state) { IocClients::instance().onHook(state); }
}  // namespace

void IocClients::onHook(int state) {
  if (state == initHookAfterIocRunning) start();
  if (state == initHookAtShutdown) close();
  if (state == initHookBeforeFree) forget();
}

void IocClients::start() {
  // PAIR(ioc-running): stored after the initialisation of the records.
  isRunning_.store(true, std::memory_order_release);
  const std::lock_guard lock(mutex_);
  for (const auto& [key, connection] : connections_) connection->reportAbsence();
}

void IocClients::close() {
  isRunning_.store(false, std::memory_order_relaxed);
  std::vector<std::shared_ptr<SharedClient>> connections;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, connection] : connections_) connections.push_back(connection);
  }
  for (const auto& connection : connections) connection->close();
  if (!dispatcher_) return;
  thread_.request_stop();
  dispatcher_->interrupt();
  thread_.join();
  dispatcher_.reset();
}

void IocClients::forget() {
  const std::lock_guard lock(mutex_);
  for (auto& callbacks : callbacks_) callbacks.clear();
  devices_.clear();
  connections_.clear();
}

std::shared_ptr<SharedClient> IocClients::connectionTo(const std::string& server,
                                                       std::int32_t location,
                                                       const std::string& user) {
  initHookRegister(onInitHook);  // Base forgets hooks when an IOC ends
  const std::lock_guard lock(mutex_);
  if (!dispatcher_) startDispatcher();
  auto& connection = connections_[{server, location, user}];
  if (!connection) connection = std::make_shared<SharedClient>(*dispatcher_, server, location);
  return connection;
}

void IocClients::add(std::unique_ptr<DevMpf> owner, Device& device) {
  initHookRegister(onInitHook);  // also for a refused device, which has no connection
  const std::lock_guard lock(mutex_);
  devices_.emplace_back(std::move(owner), &device);
}

void IocClients::startDispatcher() {
  dispatcher_.emplace(Backplane::attach());
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void IocClients::run(const std::stop_token& stop) {
  constexpr int kBatches = 8;  // steps of the dispatcher before callbacks are requested
  ::pthread_setname_np(::pthread_self(), "mpf-dispatcher");
  auto nextTick = Deadline::after(kTick);
  while (!stop.stop_requested()) {
    try {
      if (dispatcher_->runOnce(nextTick)) static_cast<void>(dispatcher_->runPending(kBatches));
      if (nextTick.hasPassed()) {
        nextTick = Deadline::after(kTick);
        tick();
      }
      flush();
    } catch (const std::exception& error) {  // no memory for a message
      errlogPrintf("MPF: a message is lost: %s\n", error.what());
    }
  }
}

void IocClients::tick() {
  const std::lock_guard lock(mutex_);
  const auto nowNs = Clock::nowNs();
  for (const auto& [key, connection] : connections_) connection->serveBacklog();
  for (const auto& [owner, device] : devices_) device->tick(nowNs);
  if (nextLook_.hasPassed()) lookForStoppedServers();
}

void IocClients::lookForStoppedServers() {
  nextLook_ = Deadline::after(kLook);
  std::map<SharedClient*, std::int32_t> pids;
  std::set<std::int32_t> all;
  for (const auto& [key, connection] : connections_) {
    if (std::get<2>(key).empty()) continue;  // its records have timeouts
    pids[connection.get()] = connection->serverPid();
    all.insert(pids[connection.get()]);
  }
  stopped_.look(all);
  for (const auto& [connection, pid] : pids) connection->setServerStopped(stopped_.contains(pid));
}

void IocClients::flush() {
  // PAIR(ioc-running): callbacks see what the initialisation of the records wrote.
  if (!isRunning_.load(std::memory_order_acquire)) return;
  for (auto& callbacks : callbacks_) callbacks.flush();
}

void IocClients::print(int level) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, connection] : connections_) {
    const auto reason = connection->notConnectedBecause();
    const auto members = static_cast<unsigned>(connection->members());
    epicsStdoutPrintf("server \"%s\" at location %d: %u record%s, %s\n",
                      connection->server().c_str(), connection->location(), members,
                      members == 1 ? "" : "s", reason.empty() ? "connected" : reason.c_str());
  }
  if (level < 1) return;
  for (const auto& [owner, device] : devices_) device->print();
}

namespace {

// dbior prints the connections once, as those of a driver.
long report(int level) {
  IocClients::instance().print(level);
  return 0;
}
drvet drvMpf{2, report, nullptr};

}  // namespace

extern "C" {
epicsExportAddress(drvet, drvMpf);
}

}  // namespace mpf
