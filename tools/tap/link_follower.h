// SPDX-License-Identifier: MIT
// LinkFollower: reads the messages that the client and the server of a link exchange, without
// taking part.
//
//   request ring ─ RingFollower ─┐
//                                ├─► take(): TappedMessages, a reply never before its request
//   reply ring ─── RingFollower ─┘
//
// Threads  one.
// Crash    after a side has died, the messages that it sent are read to the end.
// Trust    both sides may write invalid data: it is reported, or counted as missed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <mpf/message.h>

#include "tools/tap/bulk_reader.h"
#include "tools/tap/ring_follower.h"

namespace mpf::tools {

enum class Direction { request, reply };

struct TappedMessage {
  Direction direction{};
  std::uint32_t requestId = 0;
  bool isFirstReply = false;  // a reply that ends its request
  // The body is in a pool and was read after the receiver, which may write there, had taken it.
  bool mayHaveChanged = false;
  Message message;  // unsound if the body does not fit the type; empty if it could not be read
  std::string problem;  // why it could not be read
};

class LinkFollower {
 public:
  // nullptr when the link no longer exists.
  //   throws  SegmentError, std::system_error when it may not be read
  static std::unique_ptr<LinkFollower> tryOpen(const std::string& backplane,
                                               const std::string& name, FollowFrom from);

  // Appends the messages that were sent since the last call. True when there was any, seen or
  // missed.
  bool take(std::vector<TappedMessage>& messages);
  // Number of messages that were sent since the follower began and not seen. Exact while neither
  // side sends.
  [[nodiscard]] std::uint64_t missed() const noexcept { return requests_.missed + replies_.missed; }
  // A side has closed the link.
  [[nodiscard]] bool isOver() const;

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return segment_.header(); }

 private:
  struct Side {
    RingFollower follower;
    const layout::Word64& counter;
    const layout::RingControl& consumer;
    std::uint64_t sentBefore = 0;  // messages sent before the follower began
    std::uint64_t seen = 0;
    std::uint64_t missed = 0;
    bool wasOverrun = false;

    // Messages sent so far. The last one may not be counted yet.
    [[nodiscard]] std::uint64_t sent() const noexcept;
    // The follower is behind all messages of `counted`: each has been seen or missed.
    void noteSent(std::uint64_t counted) noexcept;
  };
  LinkFollower(const std::string& backplane, Segment segment, FollowFrom from);
  Side begin(Direction direction, FollowFrom from) const;
  bool drain(Side& side, Direction direction, std::vector<TappedMessage>& messages);
  TappedMessage read(const RingCopy& copy, const Side& side, Direction direction);
  void readBody(const RingCopy& copy, const Side& side, TappedMessage& tapped);

  Segment segment_;
  BulkReader bulk_;
  Side requests_;
  Side replies_;
  std::vector<TappedMessage> newRequests_;
  std::vector<TappedMessage> newReplies_;
};

}  // namespace mpf::tools
