// SPDX-License-Identifier: MIT
#include <mpf/message.h>

#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>

namespace mpf {

namespace {

class HeapLender final : public BodyLender {
 public:
  void takeBack(std::byte* data, std::size_t) noexcept override {
    // NOLINTNEXTLINE(cppcoreguidelines-no-malloc): owner of the memory of allocateHeapBody()
    std::free(data);
  }
};

constinit HeapLender theHeap;

}  // namespace

BodyLender& heapLender() noexcept { return theHeap; }

BodyBytes allocateHeapBody(std::size_t bytes) {
  constexpr std::size_t kAlignment = 64;
  if (bytes > PTRDIFF_MAX - kAlignment) throw std::bad_alloc();
  auto* const data = static_cast<std::byte*>(
      std::aligned_alloc(kAlignment, (bytes + kAlignment - 1) / kAlignment * kAlignment));
  if (data == nullptr) throw std::bad_alloc();
  return {.data = data, .size = bytes, .capacity = bytes, .lender = &theHeap};
}

Message Message::copyOf(MessageType type, std::span<const std::byte> bytes) {
  if (bytes.size() <= kInlineBytes) return copyInline(type, bytes);
  const BodyBytes body = allocateHeapBody(bytes.size());
  std::memcpy(body.data, bytes.data(), bytes.size());
  return adopt(type, body);
}

Message Message::duplicate() const {
  Message copy = copyOf(getType(), body());
  const BodyLayout layout = layoutOf(getType());
  // A peer may have written another length into the body.
  if (isSound() && layout.elementBytes != 0)
    std::memcpy(copy.data() + layout.lengthOffset, &state_.length, sizeof state_.length);
  copy.state_.clientType = state_.clientType;
  copy.state_.clientExtra = state_.clientExtra;
  copy.state_.timeStampNs = state_.timeStampNs;
  copy.state_.route = state_.route;
  copy.state_.route.keeper = nullptr;  // only the first handle reports a request that is dropped
  return copy;
}

void Message::refuseLength(MessageType type, std::size_t length, std::size_t room) {
  throw std::length_error(std::string(toString(type)) + ": length " + std::to_string(length) +
                          " is too large: there is room for " + std::to_string(room));
}

}  // namespace mpf
