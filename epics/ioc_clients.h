// SPDX-License-Identifier: MIT
// IocClients: the connections and the device support objects of the IOC of this process.
//
//   starting ─ IOC runs ─► running ─ IOC shuts down ─► closed ─ IOC frees records ─► starting
//   messages wait          callbacks are requested     no message is received
//
// Only the isolated IOC of a test frees its records, after it has stopped all that processes them.
// The process of another IOC ends when the IOC is closed. Until then Channel Access, and before
// Base 7.0.8 also scans and callbacks, may process records, so their devices are kept.
//
// Its thread runs the dispatcher of all connections. After each few messages it requests the
// callbacks of their records, and every kTick it looks for requests without a reply in time. Every
// kLook it looks for servers of subscriptions that are stopped: a server that is idle sends nothing
// either.
//
// Threads  any.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <mpf/dispatcher.h>

#include "epics/callback_queue.h"
#include "epics/shared_client.h"
#include "epics/stopped_processes.h"

namespace mpf {

class IocClients {
 public:
  static constexpr auto kTick = std::chrono::milliseconds(20);
  static constexpr auto kLook = std::chrono::seconds(1);

  class Device {
   public:
    virtual void tick(std::int64_t nowNs) = 0;
    virtual void print() const = 0;

   protected:
    ~Device() = default;
  };

  static IocClients& instance();

  // The connection to a server. All callers with the same arguments get the same object.
  //   user  name of the record that needs a connection of its own; empty: shared
  [[nodiscard]] std::shared_ptr<SharedClient> connectionTo(const std::string& server,
                                                           std::int32_t location,
                                                           const std::string& user);
  // Owns `owner` from now on, of which `device` is a part, until the IOC frees its records.
  void add(std::unique_ptr<DevMpf> owner, Device& device);
  // The queue of records with this PRIO. Its callback is requested soon, but not before the IOC
  // runs: that would process records too early.
  [[nodiscard]] CallbackQueue& callbacks(std::size_t priority) { return callbacks_.at(priority); }
  void print(int level) const;
  // Called by the IOC with an initHookState.
  void onHook(int state);

 private:
  IocClients() = default;
  void start();
  void close();
  void forget();
  void startDispatcher();
  void run(const std::stop_token& stop);
  void tick();
  void lookForStoppedServers();
  void flush();

  mutable std::mutex mutex_;
  using Key = std::tuple<std::string, std::int32_t, std::string>;  // server, location, user
  std::map<Key, std::shared_ptr<SharedClient>> connections_;
  std::vector<std::pair<std::unique_ptr<DevMpf>, Device*>> devices_;  // both under mutex_
  std::array<CallbackQueue, NUM_CALLBACK_PRIORITIES> callbacks_{
      CallbackQueue(priorityLow), CallbackQueue(priorityMedium), CallbackQueue(priorityHigh)};
  std::atomic<bool> isRunning_{false};
  std::optional<Dispatcher> dispatcher_;  // from the first connection until the IOC shuts down
  std::jthread thread_;
  StoppedProcesses stopped_;  // of the thread, as the next
  Deadline nextLook_ = Deadline::after(kLook);
};

}  // namespace mpf
