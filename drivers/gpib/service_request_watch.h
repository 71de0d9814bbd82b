// SPDX-License-Identifier: MIT
// ServiceRequestWatch: calls handlers while the SRQ line of a GPIB bus is active.
//
//   controller ── report() ──► own thread ──► handler, handler, ...
//   isActive() ◄── each period ── own thread, while there are handlers, if the controller does not
//                                 report or the line was active the last time
//
// Threads  its own thread calls isActive() and the handlers; any thread may call the functions.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "drivers/gpib/handler_list.h"

namespace mpf {

class ServiceRequestWatch {
 public:
  //   isActive  asks for the line; may take its time
  //   every     the period
  ServiceRequestWatch(std::function<std::optional<bool>()> isActive,
                      std::chrono::milliseconds every);
  ~ServiceRequestWatch();
  ServiceRequestWatch(const ServiceRequestWatch&) = delete;
  ServiceRequestWatch& operator=(const ServiceRequestWatch&) = delete;

  // The line has become active.
  void report();
  // Whether somebody calls report(). To be set once, at first: false.
  void setReported(bool isReported);
  // The handler runs until the returned object is destroyed, which must be before this object.
  [[nodiscard]] std::shared_ptr<void> add(std::function<void()> handler);

 private:
  void run();

  const std::function<std::optional<bool>()> isActive_;
  const std::chrono::milliseconds every_;
  HandlerList<> handlers_;
  std::mutex mutex_;  // all below but the thread
  std::condition_variable changed_;
  bool isControllerReporting_ = false;
  bool hasReport_ = false;
  bool hasNewHandler_ = false;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace mpf
