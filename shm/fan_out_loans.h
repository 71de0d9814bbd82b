// SPDX-License-Identifier: MIT
// FanOutLoans: what the client of one link holds of the server's fan-out pool, and how many
// messages of each of its requests were dropped because it held too much.
//
//   lend ─┬─► takeBack    the client has returned the chunk
//         ├─► endAll      the client was killed: it reads no more
//         └─► retireAll   the link has ended, but the client may still read
//
// Threads  the caller serialises all functions; Link does.
// Crash    memory of the server: a client that dies cannot leave it in a wrong state.
// Trust    a client can only return what it holds.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "shm/fan_out_pool.h"

namespace mpf {

class FanOutLoans {
 public:
  FanOutLoans() noexcept = default;
  ~FanOutLoans() { retireAll(); }
  FanOutLoans(FanOutLoans&&) noexcept = default;
  FanOutLoans& operator=(FanOutLoans&&) = delete;

  [[nodiscard]] std::uint32_t count() const noexcept {
    return static_cast<std::uint32_t>(held_.size());
  }
  // Counts the link as a holder of the chunk. Returns false if there is no memory.
  [[nodiscard]] bool tryLend(const std::shared_ptr<FanOutChunk>& chunk) noexcept;
  // Ends one loan of the chunk with this number. Does nothing if the client does not hold it.
  void takeBack(std::uint32_t number) noexcept;
  void endAll() noexcept;
  void retireAll() noexcept;

  // Counts a message of a request that was dropped.
  void noteMissed(std::uint32_t requestId) noexcept;
  // The number of messages of a request that were dropped since the last forgetMissed().
  [[nodiscard]] std::uint32_t missed(std::uint32_t requestId) const noexcept;
  void forgetMissed(std::uint32_t requestId) noexcept;

 private:
  struct Missed {
    std::uint32_t requestId;
    std::uint32_t count;
  };
  std::vector<std::shared_ptr<FanOutChunk>> held_;
  std::vector<Missed> missed_;  // of the requests whose client has not been told yet
};

}  // namespace mpf
