// SPDX-License-Identifier: MIT
// Exchange: a request of a Python program and what came back. Exchanges: those of one client. They
// contain no Python.
//
// Threads  one at a time; Requester guards them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>

#include <mpf/message.h>

namespace mpf::python {

struct Exchange {
  std::uint32_t id = 0;  // 0: not sent, or sent again under another number
  Message reply;
  bool hasReply = false;  // also after `reply` was moved out
  bool isBorrowed = false;  // the body of `reply` is in the memory of the connection
  std::optional<Fate> fate;
  // Further replies wait here, at most `limit`; then the oldest is dropped and counted in `missed`.
  std::deque<Message> further;
  std::size_t limit = 0;
  std::uint64_t missed = 0;
  bool isDisconnected = false;  // no more further replies: the connection has ended

  [[nodiscard]] bool hasEnded() const noexcept { return fate || hasReply; }
};

// Finds an exchange by its id. A client that has sent 2^32 requests uses their ids again, so two
// exchanges may have the same one: a subscription that has had its first reply, and a request that
// has had none.
class Exchanges {
 public:
  void add(Exchange& exchange) { byId_.emplace(exchange.id, &exchange); }
  void remove(const Exchange& exchange) noexcept {
    const auto [first, last] = byId_.equal_range(exchange.id);
    const auto at =
        std::find_if(first, last, [&](const auto& each) { return each.second == &exchange; });
    if (at != last) byId_.erase(at);
  }
  void clear() noexcept { byId_.clear(); }

  // The exchange to which a message belongs, or nullptr.
  //   endsRequest  whether the message is a first reply or a fate
  [[nodiscard]] Exchange* tryFind(std::uint32_t id, bool endsRequest) const noexcept {
    const auto [first, last] = byId_.equal_range(id);
    for (auto at = first; at != last; ++at)
      if (at->second->hasEnded() != endsRequest) return at->second;
    return nullptr;
  }
  template <class Visit>
  void forEach(const Visit& visit) const {
    for (const auto& [id, exchange] : byId_) visit(*exchange);
  }

 private:
  std::unordered_multimap<std::uint32_t, Exchange*> byId_;
};

}  // namespace mpf::python
