// SPDX-License-Identifier: MIT
// Dispatcher::Impl: the endpoint of a process's clients, and what is due for them.
//
// Threads  one thread runs it; post() and noteDue() may be called by any.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include <mpf/client/binding.h>
#include <mpf/client/dispatcher.h>
#include <mpf/client/round.h>

namespace mpf {

class Dispatcher::Impl {
 public:
  Impl(Backplane backplane, const DispatcherOptions& options);
  ~Impl();

  // The thread keeps `self` alive.
  void startThread(const std::shared_ptr<Impl>& self);
  void endThread();
  bool runOnce(Deadline deadline);
  void interrupt() noexcept;
  int descriptor();
  bool runPending(int most);
  [[nodiscard]] Deadline nextDue() const noexcept { return Deadline::atNs(dueNs_.load(std::memory_order_relaxed)); }

  // Runs `command` on the dispatcher's thread: now when this is it (or nobody's), else later.
  void post(std::function<void()> command);
  // On the dispatcher's thread, and not before the callback that is running has returned.
  void postLater(std::function<void()> command);
  // As post(), and waits until it has run.
  void postAndWait(std::function<void()> command);
  // Something is due at `ns`.
  void noteDue(std::int64_t ns) noexcept;

  Endpoint& endpoint() noexcept { return endpoint_; }
  void add(const std::shared_ptr<Binding>& binding) { bindings_.insert(binding); }
  // The binding lives until no callback of it can be running.
  void remove(const std::shared_ptr<Binding>& binding);
  void setLink(std::uint32_t index, Binding* binding);
  // Looks for servers whenever a new one may have appeared, while `waiting` bindings do not have theirs.
  void waitForNames(bool wait);

  // Whether callbacks may be run by the calling thread.
  [[nodiscard]] bool isHome() const noexcept { return !hasThread_ || std::this_thread::get_id() == thread_.get_id(); }

 private:
  bool step();
  void dropKnocks() noexcept;
  bool handleNews();
  bool goOnWithRounds();
  void handleDue();
  void runCommands();

  Endpoint endpoint_;
  std::set<std::shared_ptr<Binding>> bindings_;
  std::vector<std::shared_ptr<Binding>> removed_;
  std::vector<Binding*> byIndex_;
  std::mutex commandMutex_;
  std::vector<std::function<void()>> commands_;
  std::atomic<bool> hasCommands_{false};
  std::atomic<bool> namesChanged_{false};
  Round dead_;     // of those whose server may have died
  Round waiting_;  // of those whose server may be there
  Round due_;
  Watcher::Token namesToken_ = 0;
  std::atomic<std::int64_t> dueNs_{INT64_MAX};
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  std::atomic<std::thread::id> runner_;
  int depth_ = 0;  // of steps, in callbacks of steps
  bool hasDescriptor_ = false;
  bool hasThread_ = false;
  std::thread thread_;
};

}  // namespace mpf
