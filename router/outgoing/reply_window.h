// SPDX-License-Identifier: MIT
// ReplyWindow: the bytes of replies that a peer may send to one client before it gets credit for
// them (router.capnp, Credit).
//
//   received() ─► uncredited ─► taken() by the client ─► credit for a quarter of the window at a time
//
// Threads  one.
#pragma once

#include <cstdint>

namespace mpf::router {

class ReplyWindow {
 public:
  explicit ReplyWindow(std::uint32_t bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] std::uint32_t bytes() const noexcept { return bytes_; }
  // Whether the peer must not send another reply now. The last reply may exceed the window.
  [[nodiscard]] bool isUsedUp() const noexcept { return uncredited_ >= bytes_; }
  void received(std::uint32_t bytes) noexcept { uncredited_ += bytes; }
  // The client has received a reply, or it was dropped. Returns the credit to be sent now; 0: none.
  [[nodiscard]] std::uint32_t taken(std::uint64_t bytes) noexcept;

 private:
  std::uint32_t bytes_;
  std::uint64_t uncredited_ = 0;  // bytes of replies for which no credit has been given
  std::uint32_t taken_ = 0;  // of these, bytes that the client has received
};

}  // namespace mpf::router
