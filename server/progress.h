// SPDX-License-Identifier: MIT
// Progress: publishes in the window of a server which request it handles, and when it last took
// one, so that tools and clients can show why the server does not take other requests.
//
// Threads  the server's thread.
#pragma once

#include <cstdint>

#include <mpf/message_types.h>

#include "shm/layout.h"

namespace mpf {

class Progress {
 public:
  explicit Progress(layout::WindowControl& control) noexcept : control_(control) {}

  // Shows a request, until end(), as the one that the server handles.
  //   cmd  the bytes of its body at layout::kCmdOffset; ignored for types without a `cmd`
  void begin(MessageType type, std::int32_t cmd) noexcept;
  void end() noexcept;
  // Stores the time of the request that was taken last.
  void note(std::int64_t nowNs) noexcept;
  // The server has slept.
  void noteSleep() noexcept { isDue_ = true; }
  // Whether to note the time of the next request, even if it is not timed: requests take so long
  // that reading the clock for each of them costs little, or the server has slept before.
  [[nodiscard]] bool isDue() const noexcept { return isDue_; }

 private:
  layout::WindowControl& control_;
  bool isHandling_ = false;  // the window shows a request
  bool isDue_ = false;
  std::int64_t notedAtNs_ = 0;  // the last time that was stored
  std::uint64_t notedTaken_ = 0;  // number of requests taken until then
};

}  // namespace mpf
