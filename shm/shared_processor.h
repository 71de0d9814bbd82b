// SPDX-License-Identifier: MIT
// SharedProcessor: what a wait that polls does about others that need its processor. The peer may be
// among them, or the router on the way to it.
//
//   yield   polls, and gives the processor up now and then
//   keep    polls and keeps the processor: others use it for long, so they are not the peer, and a
//           message may come within their time slice
//   sleep   does not poll: giving the processor up has let others run for a short time, but brought
//           no message; a wake-up then costs less than taking turns with them
//
// Threads  one owner thread.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mpf {

class SharedProcessor {
 public:
  enum class Plan { yield, keep, sleep };
  // Begins a wait.
  [[nodiscard]] Plan plan() noexcept {
    if (keeps_ != 0) {
      --keeps_;
      return Plan::keep;
    }
    return inVain_ < kMaxInVain || ++sleeps_ % kYieldEvery == 0 ? Plan::yield : Plan::sleep;
  }
  // A wait has given the processor up for this duration; `hasEvents`: then it had something to do.
  void noteYield(std::int64_t ns, bool hasEvents) noexcept {
    if (hasEvents) inVain_ = 0;
    else if (ns >= kOthersRanNs && ns < kStreamNs) inVain_ = std::min(inVain_ + 1, kMaxInVain);
    if (ns < kLongYieldNs) {
      lastKeeps_ -= (lastKeeps_ + kForgetting - 1) / kForgetting;
    } else {
      keeps_ = lastKeeps_ = std::min(2 * lastKeeps_ + kFirstKeeps, kMaxKeeps);
    }
  }

 private:
  // A yield takes less if no other process can run: 0.8 us where two changes of process take 4.
  static constexpr std::int64_t kOthersRanNs = 1500;
  // A router that works longer has a stream of messages: the next ones come soon.
  static constexpr std::int64_t kStreamNs = 40'000;
  static constexpr std::uint32_t kMaxInVain = 4;  // in succession
  static constexpr std::uint32_t kYieldEvery = 64;  // waits
  static constexpr std::int64_t kLongYieldNs = 1'000'000;
  static constexpr std::uint32_t kFirstKeeps = 8;
  static constexpr std::uint32_t kMaxKeeps = 1u << 14;
  static constexpr std::uint32_t kForgetting = 64;

  std::uint32_t keeps_ = 0;  // waits that will keep the processor
  std::uint32_t lastKeeps_ = 0;  // after the last long yield
  std::uint32_t inVain_ = 0;  // yields in succession that brought nothing
  std::uint32_t sleeps_ = 0;  // waits with this plan
};

}  // namespace mpf
