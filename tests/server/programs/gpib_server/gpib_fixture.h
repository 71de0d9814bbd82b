// SPDX-License-Identifier: MIT
// GpibServerTest: a GPIB server over a fake controller. GpibAsker: a client of it.
#pragma once

#include <gmock/gmock.h>
#include <string>
#include <string_view>

#include <mpf/gpib_commands.h>
#include <mpf/sync_client.h>

#include "server/programs/gpib_server/gpib_server.h"
#include "tests/drivers/gpib/fake_controller.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

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

class GpibServerTest : public testing::Test {
 protected:
  static constexpr std::chrono::hours kLong{24};

  void SetUp() override {
    served_.start([] { FAIL() << "the server failed"; });
  }
  // A request with a timeout that does not pass.
  static Char8Array patient(std::int32_t cmd, std::int32_t address = 22) {
    return {.timeout = 36'000, .cmd = cmd, .address = address};
  }
  static Char8Array within(std::int32_t milliseconds, std::int32_t cmd, std::int32_t address = 22) {
    return {.timeout = milliseconds, .cmd = cmd | gpib::cmdTimeoutMilliseconds, .address = address};
  }
  static Char8Array leaseFor(std::int32_t milliseconds) {
    auto fields = patient(gpib::cmdLease);
    fields.extra = milliseconds;
    return fields;
  }
  [[nodiscard]] bool hasOperation(const std::string& operation) const {
    const auto all = fake_.operations();
    return std::ranges::find(all, operation) != all.end();
  }

  Watchdog watchdog_{"GPIB server test"};
  ServerLog log_{"test", "off"};
  FakeGpib fake_;
  GpibBus bus_{fake_.makeController(), {.pollServiceRequestEvery = std::chrono::milliseconds(5)}};
  TestBackplane backplane_;
  MessageServer server_{backplane_, "gpib"};
  GpibServer served_{
      server_, bus_, {.bufferBytes = 2 << 20, .maxTimeout = kLong, .maxLease = kLong}, log_};
};

}  // namespace mpf::test
