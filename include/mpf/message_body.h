// SPDX-License-Identifier: MIT
// BodyLender, BodyBytes: the memory of a message body that is too large for the handle.
//
//   lender ── BodyBytes ──► Message::adopt() ── handle is destroyed ──► lender.takeBack()
//          └─ BodyBytes ──► takeBack(), if no handle adopts it
//
// The lender of a body in shared memory is a link; the lender of a body of this process is
// heapLender(). Programs that only send and receive messages need none of this: MessageOf<T>,
// MessageClient::alloc() and MessageServer::allocReplyMessage() allocate bodies.
//
// Threads  a lender is called by the threads that destroy handles, by several at once.
// Source   manual, "Free Lists for Array Messages", which this replaces.
#pragma once

#include <cstddef>

#include <mpf/detail/cpp20.h>

namespace mpf {

// Owns the memory of out-of-line bodies and outlives every handle that uses that memory.
class BodyLender {
 public:
  // Returns one body to its owner. Called exactly once for each body, by any thread.
  //   data, capacity   as in the BodyBytes that the lender handed out
  virtual void takeBack(std::byte* data, std::size_t capacity) noexcept = 0;

 protected:
  ~BodyLender() = default;
};

// Describes an out-of-line body, for transports. It owns nothing and frees nothing: pass it to
// Message::adopt() or to BodyLender::takeBack(), exactly once.
struct BodyBytes {
  std::byte* data = nullptr;  // aligned to 8 bytes or more
  std::size_t size = 0;       // [bytes] in use, at most capacity
  std::size_t capacity = 0;   // [bytes] allocated
  BodyLender* lender = nullptr;
};

// Allocates memory of this process, aligned to 64 bytes and not initialised. Any thread.
//   returns  a body with size = capacity = bytes and the lender heapLender()
//   throws   std::bad_alloc
[[nodiscard]] BodyBytes allocateHeapBody(std::size_t bytes);
// The lender of all bodies of allocateHeapBody(); it exists until the process exits.
[[nodiscard]] BodyLender& heapLender() noexcept;

}  // namespace mpf
