// SPDX-License-Identifier: MIT
// GpibAsker: a client of a GPIB server.
#pragma once

#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <string>
#include <string_view>
#include <utility>

#include <mpf/drivers/gpib/gpib_types.h>
#include <mpf/gpib_commands.h>
#include <mpf/gpib_sniff.h>
#include <mpf/sync_client.h>

namespace mpf::test {

struct GpibAnswer {
  std::int32_t status = -1;
  std::int32_t extra = 0;
  std::string text{};
  friend bool operator==(const GpibAnswer&, const GpibAnswer&) = default;
};

class GpibAsker {
 public:
  explicit GpibAsker(const Backplane& backplane, const std::string& server = "gpib")
      : client_(backplane, server) {
    EXPECT_TRUE(client_.connectWait(std::chrono::minutes(1)));
  }

  // Sends one request and returns its reply.
  GpibAnswer ask(const Char8Array& fields, std::string_view value = {}) {
    auto answer = client_.call(messageOf(fields, value), std::chrono::minutes(10));
    EXPECT_TRUE(answer) << answer.why();
    const auto reply = answer.as<Char8Array>();
    if (!reply) return {};
    return {(*reply)->status, (*reply)->extra, {reply->value().begin(), reply->value().end()}};
  }
  // Sends a request without waiting for its reply.
  void send(const Char8Array& fields, std::string_view value = {}) {
    EXPECT_EQ(client_.client().send(messageOf(fields, value)), SendResult::sent);
  }
  // The next message of a subscription.
  OutOfBand receive() {
    const auto message = client_.receive(std::chrono::minutes(10));
    const auto* const notice = message.tryAs<OutOfBand>();
    EXPECT_NE(notice, nullptr);
    return notice != nullptr ? *notice : OutOfBand{};
  }
  // Whether a message of a subscription has come.
  bool hasMessage() { return static_cast<bool>(client_.receive(Nanoseconds(0))); }
  SyncClient& client() noexcept { return client_; }

 private:
  static Char8ArrayMessage messageOf(const Char8Array& fields, std::string_view value) {
    auto message = Char8ArrayMessage::allocValue(value.size());
    *message = fields;
    message.setSize(value.size());
    std::ranges::copy(value, message.value().begin());
    return message;
  }
  SyncClient client_;
};

}  // namespace mpf::test
