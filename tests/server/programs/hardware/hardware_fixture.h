// SPDX-License-Identifier: MIT
// HardwareTest: a model carrier and a backplane, for tests of servers that drive modules;
// HardwareAsker: a client of such a server.
#pragma once

#include <gmock/gmock.h>
#include <memory>
#include <string>

#include <mpf/drivers/industry_pack/module.h>
#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "server/programs/server_log.h"
#include "tests/support/alarms.h"
#include "tests/support/model_carrier.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

class HardwareAsker {
 public:
  HardwareAsker(const Backplane& backplane, const std::string& server)
      : client_(backplane, server) {}

  // The reply; status -99 without a reply.
  Int32 ask(Int32 fields) {
    auto answer = client_.call(Int32Message(fields), 60s);
    EXPECT_TRUE(answer) << answer.why();
    return answer ? take(answer.message()) : Int32{.status = -99};
  }
  // The next further reply.
  Int32 next() {
    auto message = client_.receive(60s);
    EXPECT_TRUE(message);
    return message ? take(message) : Int32{.status = -99};
  }
  // Whether the server sent no further reply before the last reply.
  [[nodiscard]] bool isSilent() { return !client_.receive(0s); }
  [[nodiscard]] SyncClient& client() noexcept { return client_; }

  // Sends each type except Int32: the reply has status -1; that to a SerialConfig is an Int32.
  void expectRefusalOfOtherTypes() {
    expectStatus<Int32Array>(Int32ArrayMessage::allocValue(1));
    expectStatus<Float64>(Float64Message());
    expectStatus<Float64Array>(Float64ArrayMessage::allocValue(1));
    expectStatus<Char8Array>(Char8ArrayMessage::allocValue(1));
    expectStatus<Int32>(SerialConfigMessage());
  }

 private:
  static Int32 take(const Message& message) {
    const auto* const fields = message.tryAs<Int32>();
    EXPECT_NE(fields, nullptr);
    return fields != nullptr ? *fields : Int32{.status = -99};
  }
  template <class Reply, class Request>
  void expectStatus(MessageOf<Request>&& request) {
    auto answer = client_.call(std::move(request), 60s);
    ASSERT_TRUE(answer) << Request::kName << answer.why();
    const auto* const fields = answer.message().template tryAs<Reply>();
    ASSERT_NE(fields, nullptr) << Request::kName;
    EXPECT_EQ(fields->status, -1) << Request::kName;
  }
  SyncClient client_;
};

class HardwareTest : public testing::Test {
 protected:
  [[nodiscard]] std::uint64_t alarms(const std::string& server) const {
    return alarmsOf(backplane_, server);
  }

  Watchdog watchdog_{"hardware server test"};
  ServerLog log_{"test", "off"};
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  IndustryPackModules modules_{carriers_};
  TestBackplane backplane_;
};

}  // namespace mpf::test
