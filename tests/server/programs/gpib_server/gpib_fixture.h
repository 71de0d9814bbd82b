// SPDX-License-Identifier: MIT
// GpibServerTest: a GPIB server over a fake controller.
#pragma once

#include <algorithm>
#include <gmock/gmock.h>
#include <string>

#include "server/programs/gpib_server/gpib_server.h"
#include "tests/drivers/gpib/fake_controller.h"
#include "tests/server/programs/gpib_server/gpib_asker.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

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
