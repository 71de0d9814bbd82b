// SPDX-License-Identifier: MIT
// GhostScript: what a recorded server replied to which request, and when.
//
//   GhostScript script("calls.mpf");
//   if (const auto* exchange = script.next(request).exchange) use(exchange->replies);
//
//   request ─┬─ the same type and fields as a recorded one ─────────► its replies
//            ├─ the same but for `value` and `timeout` ─────────────► the replies to that one
//            └─ neither ────────────────────────────────────────────► nullptr
//
// When several recorded requests fit, their replies are used in turn, and again from the first one
// after the last. Requests of all recorded clients count alike.
//
// Threads  one.
// Trust    a file is untrusted: see RecordingReader.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include <mpf/clock.h>
#include <mpf/message.h>

namespace mpf::tools {

struct GhostReply {
  Nanoseconds after;  // time from the request
  std::int64_t atNs;  // CLOCK_REALTIME of the recording
  Message message;  // a RequestFate: the server refused the request
};

// A recorded request, without itself; no replies: the server never replied.
struct GhostExchange {
  std::int64_t atNs;
  std::vector<GhostReply> replies;  // in the order of time
};

class GhostScript {
 public:
  // Reads the exchanges with the first server in the file.
  //   throws  std::system_error, std::runtime_error for invalid data and for a file without request
  explicit GhostScript(const std::string& file);

  [[nodiscard]] const std::string& server() const noexcept { return server_; }
  [[nodiscard]] std::size_t requests() const noexcept { return exchanges_.size(); }
  // Number of messages that the recording misses: their requests have no or too few replies.
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }

  enum class Match : std::uint8_t { none, similar, same };
  struct Found {
    const GhostExchange* exchange = nullptr;  // nullptr: none
    Match match = Match::none;
  };
  [[nodiscard]] Found next(const Message& request);

 private:
  // The exchanges whose requests have the same key.
  struct Case {
    std::vector<std::size_t> exchanges;
    std::size_t used = 0;
    std::size_t next() { return exchanges[used++ % exchanges.size()]; }
  };
  using Cases = std::unordered_map<std::string, Case>;
  class Reading;

  std::string server_;
  std::vector<GhostExchange> exchanges_;
  Cases same_, similar_;  // by sameKey(), similarKey()
  std::uint64_t missed_ = 0;
};

}  // namespace mpf::tools
