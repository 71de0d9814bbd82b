// SPDX-License-Identifier: MIT
// LinkFollower: what client and server of one link say to each other, read beside them.
//
//   request ring ─ RingFollower ─┐
//                                ├─► take(): TappedMessages, a reply never before its request
//   reply ring ─── RingFollower ─┘
//
// Threads  one.
// Crash    what was said is read to the end when a side dies.
// Trust    both sides may write nonsense: it is told, or counted as missed.
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
  bool isFirstReply = false;    // of a reply: it ends its request
  // its body lies in a pool and was read when its receiver, who may write there, had it already
  bool mayHaveChanged = false;
  Message message;  // unsound when the body is none of its type; empty when it could not be read
  std::string problem;  // why it could not be read
};

class LinkFollower {
 public:
  // nullptr when the link is gone.
  //   throws  SegmentError, std::system_error when it may not be read
  static std::unique_ptr<LinkFollower> tryOpen(const std::string& backplane,
                                               const std::string& name, FollowFrom from);

  // Appends what was said since the last call. True when that was something, seen or missed.
  bool take(std::vector<TappedMessage>& messages);
  // Messages that were sent since then and not seen. Exact when both sides are at rest.
  [[nodiscard]] std::uint64_t missed() const noexcept { return requests_.missed + replies_.missed; }
  // A side has closed the link.
  [[nodiscard]] bool isOver() const;

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return segment_.header(); }

 private:
  struct Side {
    RingFollower follower;
    const layout::Word64& sent;
    const layout::RingControl& consumer;
    std::uint64_t sentBefore = 0;  // messages sent when we began
    std::uint64_t seen = 0;
    std::uint64_t missed = 0;
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
