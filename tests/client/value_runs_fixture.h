// SPDX-License-Identifier: MIT
// ValueRuns: a client with a callback for values, which records what each call received.
#pragma once

#include <functional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {

class ValueRuns : public ClientTest {
 protected:
  // What one call of the callback received.
  struct Run {
    std::vector<std::int32_t> values;
    std::int32_t clientType;
    std::int32_t clientExtra;
    std::int64_t timeStampNs;
    bool endsRequest;
    std::size_t otherMessages;  // that arrived before
    std::size_t news;  // the same, of connections
  };
  void SetUp() override {
    client_.onValues<Int32>([this](std::span<const Int32> values, const Message& first) {
      Run run{{},
              first.getClientType(),
              first.getClientExtra(),
              first.getTimeStampNs(),
              (first.route().flags & kEndsRequest) != 0,
              messages_.size(),
              news_.size()};
      for (const auto& each : values) run.values.push_back(each.value);
      received_ += values.size();
      runs_.push_back(std::move(run));
      if (onCall_) onCall_(values, first);
      if (mustThrow_) throw std::runtime_error("the callback throws");
    });
  }
  static std::vector<Int32> readings(std::int32_t count, std::int32_t first = 0) {
    std::vector<Int32> values;
    for (std::int32_t i = 0; i < count; ++i) values.push_back({.value = first + i});
    return values;
  }
  void receive(std::size_t values) {
    runUntil([&] { return received_ >= values; });
    EXPECT_EQ(received_, values);
  }
  // The values received are 0, 1, 2 and so on.
  void expectNumbered() const {
    std::int32_t next = 0;
    for (const auto& run : runs_)
      for (const auto value : run.values) ASSERT_EQ(value, next++);
  }
  [[nodiscard]] std::vector<std::vector<std::int32_t>> valuesOfRuns() const {
    std::vector<std::vector<std::int32_t>> all;
    for (const auto& run : runs_) all.push_back(run.values);
    return all;
  }
  void reply(const Message& request, std::int32_t value, std::int64_t timeStampNs = 0) {
    auto message = server_->allocReplyMessage<Int32>(request);
    message->value = value;
    message.setTimeStampNs(timeStampNs);
    ASSERT_EQ(server_->reply(std::move(message)), ReplyResult::sent);
  }
  // Messages whose time in the queue is known, in all windows of clients.
  [[nodiscard]] std::uint64_t timedMessages() const {
    std::uint64_t sum = 0;
    for (const auto& name : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(name);
      if (!parsed || parsed->kind != NameKind::clientWindow) continue;
      const auto window = PeerWindow::tryOpen(name, layout::SegmentKind::clientWindow);
      for (const auto& bucket : window->control().queueWaitNs.buckets)
        sum += bucket.load(std::memory_order_relaxed);
    }
    return sum;
  }
  // A request of this client, after heldRequest().
  Message another(std::int32_t clientType) {
    const auto held = std::make_shared<Message>();
    server_->on<Int32>([held](Int32Message&& request) { *held = std::move(request); });
    Int32Message request;
    request.setClientType(clientType);
    request.setClientExtra(-clientType);
    EXPECT_EQ(client_.send(std::move(request)), SendResult::sent);
    runUntil([&] { return static_cast<bool>(*held); });
    return std::move(*held);
  }

  std::vector<Run> runs_;
  std::size_t received_ = 0;
  bool mustThrow_ = false;
  std::function<void(std::span<const Int32>, const Message&)> onCall_;
};

}  // namespace mpf::test
