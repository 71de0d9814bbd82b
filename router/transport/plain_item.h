// SPDX-License-Identifier: MIT
// PlainItem: a request without a deadline, or a reply, with a message of fixed size.
// PlainItems: plain items of one client and kind.
// PlainFrame: reads the plain items of a frame in place.
// PlainRun: builds a frame of plain items.
//
//   frame of a PlainRun = | segment table | Frame | list of items | item 0 | item 1 | ...
//                                                                   item = | Request or Reply
//                                                                          | Envelope | message |
//
// The items of one kind have the same bytes, apart from their numbers: an item is a copy of a form,
// with the numbers stored at their places. A frame may mix plain items with others, and any sender
// may arrange an item in another way; an item that does not have the pointers of a form is left to
// Cap'n Proto's own reader.
//
// Threads  one thread uses an object; the forms are shared by all threads.
// Trust    a frame may have any bytes. Each item is checked against the end of the frame, and costs
//          a bounded number of steps, however many pointers lead to the same words.
#pragma once

#include <array>
#include <capnp/common.h>
#include <cstddef>
#include <cstdint>
#include <kj/array.h>
#include <optional>
#include <vector>

#include <mpf/message.h>

#include "shm/messages/message_run.h"

namespace mpf::router {

// A plain item that is sent. Its message satisfies PlainItem::canCarry().
struct PlainOutgoing {
  bool isRequest;
  bool isFirst;  // of a reply: it ends the request
  std::uint32_t client;
  std::uint32_t requestId;
  const Message& message;  // of a reply: its getMissed() is sent, too
};

struct PlainItem {
  bool isRequest = false;
  bool isFirst = false;  // of a reply: it ends the request
  std::uint32_t client = 0;
  std::uint32_t requestId = 0;
  Message message;

  // Whether `message` has a form that a plain item can have.
  [[nodiscard]] static bool canCarry(const Message& message) noexcept;
  // NOLINTNEXTLINE(google-explicit-constructor): the same item; its message by reference
  operator PlainOutgoing() const noexcept {
    return {isRequest, isFirst, client, requestId, message};
  }
};

// Items of one client: requests, first replies, or further replies without missed ones. The words
// of a message in `run` contain its requestId, clientType, clientExtra and time stamp. `run`
// outlives this object and does not change meanwhile.
struct PlainItems {
  bool isRequest;
  bool isFirst;
  std::uint32_t client;
  const MessageRun& run;

  [[nodiscard]] PlainItem operator[](std::size_t index) const {
    return {isRequest, isFirst, client, run[index].requestId(), run.message(index)};
  }
};

class PlainFrame {
 public:
  // nullopt: the list of items is not where PlainRun has it.
  //   segment  the only segment of the frame; it outlives this object
  [[nodiscard]] static std::optional<PlainFrame> tryOpen(
      kj::ArrayPtr<const capnp::word> segment) noexcept;

  // Reads the item at `index`, which must be less than the number of items that Cap'n Proto finds.
  // Returns false, and `item` may have changed, when it is not plain.
  [[nodiscard]] bool tryRead(std::uint32_t index, PlainItem& item) const noexcept;
  // Reads consecutive plain items from `index` on, before `end`, of one client, type and kind
  // (request, first or further reply). Stops before a request number 0. For requests and first
  // replies, it also stops before a number that is not farther from the first one (modulo 2^32)
  // than the number before, so no number occurs twice. Fills `run`, perhaps with one message or
  // none.
  [[nodiscard]] PlainItems readItems(std::uint32_t index, std::uint32_t end,
                                     MessageRun& run) const noexcept;

 private:
  struct Found;
  [[nodiscard]] bool tryFind(std::uint32_t index, Found& found) const noexcept;

  kj::ArrayPtr<const capnp::word> words_;
  std::size_t first_ = 0;  // word of item 0
  std::size_t stride_ = 0;  // words of an item in the list
  std::size_t itemPointer_ = 0;  // word of its pointer
};

class PlainRun {
 public:
  // Upper bound of a frame: head and payload.
  static constexpr std::size_t kMaxBytes = std::size_t{32} << 10;

  PlainRun();
  void clear() noexcept;
  [[nodiscard]] bool isFull() const noexcept { return payloadWords_ >= kMaxWords; }
  [[nodiscard]] std::size_t size() const noexcept { return items_.size(); }
  // Append an item; item `index` of `items`. The run must not be full.
  void append(const PlainOutgoing& item);
  void append(const PlainItems& items, std::size_t index);

  // Completes the frame: its bytes are head() followed by payload().
  void buildHead();
  [[nodiscard]] kj::ArrayPtr<const kj::byte> head() const noexcept {
    return bytesOf(head_, head_.size());
  }
  [[nodiscard]] kj::ArrayPtr<const kj::byte> payload() const noexcept {
    return bytesOf(payload_, payloadWords_);
  }

  struct Sent {
    bool isRequest;
    std::uint32_t client;
    std::uint32_t requestId;
    std::uint32_t word;  // of its struct, in the payload
  };
  [[nodiscard]] const std::vector<Sent>& items() const noexcept { return items_; }

 private:
  struct Numbers;
  void append(bool isRequest, MessageType type, const Numbers& numbers, const std::byte* body);

  using Words = std::vector<std::uint64_t>;
  static constexpr std::size_t kMaxWords = kMaxBytes / sizeof(capnp::word) / 2;

  static kj::ArrayPtr<const kj::byte> bytesOf(const Words& words, std::size_t count) noexcept {
    return {reinterpret_cast<const kj::byte*>(words.data()), count * sizeof(capnp::word)};
  }

  Words payload_;  // has room for all items of a full run
  std::size_t payloadWords_ = 0;  // of these, words in use
  Words head_;
  std::vector<Sent> items_;
};

}  // namespace mpf::router
