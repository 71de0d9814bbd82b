// SPDX-License-Identifier: MIT
// TapSink: the output of `mpf tap`.
//
//   lines   14:03:27.120417  71fa  -> 17  int32 timeout=0 cmd=0 status=0 address=3 extra=0 value=5
//   json    {"at_ns": ..., "link": "...", "direction": "request", "requestId": 17, ...}
//           One object in each line.
//   file    schema/recording.capnp, for `mpf replay`
//
// Threads  one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tools/tap/link_follower.h"

namespace mpf::tools {

// A link and its two processes. The names are untrusted: printable() must clean them before they
// are shown.
struct TappedLink {
  std::uint64_t incarnation = 0;
  std::string server;
  std::int32_t location = 0;
  std::string client;  // label or program; empty: the client had ended
  std::int32_t clientPid = 0;
};

class TapSink {
 public:
  virtual ~TapSink() = default;
  // atNs: CLOCK_REALTIME.
  virtual void opened(std::int64_t atNs, const TappedLink& link) = 0;
  virtual void message(std::int64_t atNs, const TappedLink& link, const TappedMessage& message) = 0;
  // `messages` is the total so far.
  virtual void missed(std::int64_t atNs, const TappedLink& link, std::uint64_t messages) = 0;
  virtual void closed(std::int64_t atNs, const TappedLink& link) = 0;
  // The last call. Like the others, throws std::system_error when the output cannot be written.
  virtual void finish() {}

  static std::unique_ptr<TapSink> lines(std::size_t maxElements);
  static std::unique_ptr<TapSink> json();
  // Throws std::system_error.
  static std::unique_ptr<TapSink> file(const std::string& path);
};

}  // namespace mpf::tools
