// SPDX-License-Identifier: MIT
// TapSession: follows all links of one server, or one of them, while links are created and removed
// and the server restarts.
//
//   names in /dev/shm ─► LinkFollower per link ─► TapSink
//
// Threads  one.
// Crash    the messages that a dead process sent are read to the end.
// Trust    a link that cannot be read is reported once and then ignored.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <mpf/clock.h>

#include "tools/tap/link_follower.h"
#include "tools/tap/name_watch.h"
#include "tools/tap/tap_sink.h"

namespace mpf::tools {

struct TapSelection {
  std::string backplane;
  std::string server;
  std::int32_t location = 0;
  std::string link;  // the first digits of its number; empty: all links of the server
  std::uint64_t count = UINT64_MAX;  // of messages for the sink; later ones are ignored
};

class TapSession {
 public:
  // Follows existing links from now on, and later links from their first message.
  //   throws  std::invalid_argument for invalid names
  TapSession(TapSelection selection, TapSink& sink);

  // Hands the new messages of all links to the sink. False when no message was seen or missed.
  bool runOnce();
  // Returns when there may be a new link, after `limit`, or on a signal.
  void pause(Nanoseconds limit) const noexcept { names_.wait(limit); }
  // Reads the remaining messages, also those of links that are new, and reports missed ones.
  void finish();

  [[nodiscard]] bool isServerThere() const noexcept { return incarnation_ != 0; }
  [[nodiscard]] std::size_t links() const noexcept { return followed_.size(); }
  [[nodiscard]] std::uint64_t seen() const noexcept { return seen_; }
  [[nodiscard]] std::uint64_t missed() const noexcept;
  // Number of links that were removed before they could be read.
  [[nodiscard]] std::uint64_t goneLinks() const noexcept { return goneLinks_; }
  [[nodiscard]] const std::vector<std::string>& problems() const noexcept { return problems_; }

 private:
  struct Followed {
    TappedLink link;
    std::unique_ptr<LinkFollower> follower;
    std::uint64_t missedSeen = 0;  // at the last call that found no new message
    std::uint64_t missedReported = 0;
  };
  void lookAtNames(FollowFrom from);
  void lookAtNew(const std::vector<std::string>& names);
  void dropEnded(const std::set<std::string>& there);
  void follow(const std::string& name, FollowFrom from);
  std::optional<Followed> tryOpen(const std::string& name, FollowFrom from);
  bool take(Followed& followed);
  void reportMissed(Followed& followed);
  void drain(Followed& followed);
  void close(Followed& followed);
  [[nodiscard]] bool isWanted(const std::string& name) const;

  TapSelection selection_;
  TapSink& sink_;
  std::string window_;             // name of the server's window
  std::uint64_t incarnation_ = 0;  // of the server; 0: the server is absent
  NameWatch names_;
  Deadline lookAgain_ = Deadline::never();
  std::map<std::string, Followed> followed_;  // by name
  std::set<std::string> notFollowed_;         // could not be read, or are over
  std::vector<TappedMessage> batch_;
  std::vector<std::string> problems_;
  std::uint64_t seen_ = 0;
  std::uint64_t goneLinks_ = 0;
  std::uint64_t missedBefore_ = 0;  // of links that are over
};

}  // namespace mpf::tools
