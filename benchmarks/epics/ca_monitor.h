// SPDX-License-Identifier: MIT
// CaMonitor: a client of Channel Access that monitors one record.
//
// Threads  one thread; values arrive on a thread of Channel Access.
#pragma once

#include <atomic>
#include <cstdint>
#include <semaphore>
#include <string>

struct event_handler_args;

namespace mpf::bench {

class CaMonitor {
 public:
  //   throws  std::runtime_error if the record is not found within 10 s
  explicit CaMonitor(const std::string& record);
  // Waits until the value arrives.
  void waitFor(std::int32_t value);

 private:
  static void onValue(event_handler_args event);
  std::atomic<std::int32_t> last_{-1};
  std::counting_semaphore<> arrived_{0};
};

}  // namespace mpf::bench
