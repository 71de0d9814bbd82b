// SPDX-License-Identifier: MIT
// Camera: a server that publishes images to the readers of fan_out_test.cpp, and counts what each
// of them was sent and reports.
//
// Threads  one.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <utility>

#include <mpf/message_server.h>

#include "tests/system/fan_out.h"

namespace mpf::test {

inline constexpr int kMaxBorrowed = 4;

class Camera {
 public:
  struct Reader {
    Message request;
    std::int32_t sent = 0;  // the last image that was sent
    std::int32_t dropped = 0;
    std::int32_t received = 0;  // the last image that it reported
    std::int32_t missed = 0;  // as it reports
  };

  explicit Camera(const Backplane& backplane, Rights rights = {})
      : server_(backplane, "camera",
                {.queueSize = 64,
                 .rights = rights,
                 .maxSharedBytes = 16u << 20,
                 .maxBorrowed = kMaxBorrowed}) {
    server_.on<Int32>([this](Int32Message&& request) { take(std::move(request)); });
  }

  // Publishes images to all readers until it is killed.
  [[noreturn]] void run() {
    for (;;) {
      server_.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
      while (server_.handleOne()) continue;
      publish();
    }
  }
  // Publishes one image to all readers.
  void publish() {
    auto image = server_.allocShared<Float64Array>(kPixels);
    wasCopied_ = wasCopied_ || image.lender() == &heapLender();
    image->extra = ++image_;
    std::ranges::fill(image.value(), imageElement(image_));
    for (auto& [number, reader] : readers_) {
      const auto result = server_.publish(image, reader.request);
      if (result == ReplyResult::sent) reader.sent = image_;
      if (result == ReplyResult::queueFull) ++reader.dropped;
    }
  }
  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) {
      server_.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
      while (server_.handleOne()) continue;
    }
  }
  // Publishes `count` images, each after this reader has reported all that it was sent before.
  // Returns false when an image was dropped for it.
  [[nodiscard]] bool tryShow(std::int32_t number, int count) {
    runUntil([&] { return readers_.contains(number); });
    runUntil([&] { return readers_.at(number).received == readers_.at(number).sent; });
    for (int shown = 0; shown < count; ++shown) {
      publish();
      auto& reader = readers_.at(number);
      if (reader.sent != image_) return false;
      runUntil([&] { return reader.received == image_; });
    }
    return true;
  }
  [[nodiscard]] Reader& reader(std::int32_t number) { return readers_.at(number); }
  [[nodiscard]] bool hasReader(std::int32_t number) const { return readers_.contains(number); }
  void forget(std::int32_t number) { readers_.erase(number); }
  [[nodiscard]] std::int32_t image() const noexcept { return image_; }
  // Whether an image found no chunk, so that it was copied or lost.
  [[nodiscard]] bool wasCopied() const noexcept { return wasCopied_; }
  [[nodiscard]] MessageServer& server() noexcept { return server_; }

 private:
  void take(Int32Message&& request) {
    const auto number = request->address;
    if (request->cmd == static_cast<std::int32_t>(FanOutRequest::subscribe)) {
      readers_[number] = {.request = std::move(request)};
      return;
    }
    if (auto reader = readers_.find(number); reader != readers_.end()) {
      reader->second.received = request->value;
      reader->second.missed = request->extra;
    }
    server_.reply(std::move(request));
  }

  MessageServer server_;
  std::map<std::int32_t, Reader> readers_;
  std::int32_t image_ = 0;
  bool wasCopied_ = false;
};

}  // namespace mpf::test
