// SPDX-License-Identifier: MIT
// HeldRequests: the requests of one far client that wait until the server accepts the client.
//
// Threads  one.
// Trust    holds at most as many requests as the server's queue would hold, at most kMaxBytes of
//          one client and kMaxTotalBytes of all clients of a connection. A connection that holds
//          nothing may always hold one request of any size.
#pragma once

#include <cstdint>
#include <vector>

#include <mpf/clock.h>
#include <mpf/message.h>

namespace mpf::router {

struct HeldRequest {
  std::uint32_t requestId = 0;
  Deadline takeBefore = Deadline::never();
  Message message;
  [[nodiscard]] std::size_t bytes() const noexcept {
    return sizeof(HeldRequest) + message.body().size();
  }
};

class HeldRequests {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20;
  static constexpr std::size_t kMaxTotalBytes = std::size_t{64} << 20;

  //   maxRequests  the queue size of the server
  //   totalBytes   bytes that all clients of the connection hold; outlives this object
  HeldRequests(std::uint32_t maxRequests, std::size_t& totalBytes) noexcept
      : maxRequests_(maxRequests), totalBytes_(totalBytes) {}
  ~HeldRequests() { totalBytes_ -= bytes_; }
  HeldRequests(const HeldRequests&) = delete;
  HeldRequests& operator=(const HeldRequests&) = delete;

  // Returns false, and leaves `request` unchanged, when a limit would be exceeded.
  [[nodiscard]] bool tryHold(HeldRequest&& request);
  // Remove and return requests, in the order in which they came.
  [[nodiscard]] std::vector<HeldRequest> takeExpired();
  [[nodiscard]] std::vector<HeldRequest> takeAll();
  // The earliest deadline of a held request.
  [[nodiscard]] Deadline nextDeadline() const noexcept;

 private:
  void release(std::size_t bytes) noexcept;

  std::uint32_t maxRequests_;
  std::size_t& totalBytes_;
  std::size_t bytes_ = 0;
  std::vector<HeldRequest> requests_;
};

}  // namespace mpf::router
