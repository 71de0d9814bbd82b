// SPDX-License-Identifier: MIT
// TalkTest: a Talk with a server that this thread runs, and the world that gets their complaints.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"
#include "tools/torture/talk.h"

namespace mpf::torture {

class TalkTest : public testing::Test {
 protected:
  // Runs both until the condition holds. `handle` handles the server's requests.
  template <class Handle, class Condition>
  void runUntil(const Handle& handle, const Condition& condition) {
    while (!condition()) {
      handle();
      dispatcher_.runOnce(Deadline::after(std::chrono::microseconds(100)));
    }
  }
  [[nodiscard]] std::uint64_t replies() const { return talked_.replies.load(); }

  const test::Watchdog watchdog_{"talk test"};
  const test::TestBackplane backplane_;
  const std::unique_ptr<World> world_ = std::make_unique<World>();
  Talked talked_;
  Dispatcher dispatcher_{backplane_};
  // With this seed no one of the first 40 requests has a deadline or is cancelled, and there are
  // numbers and arrays among the first 6.
  static constexpr std::uint32_t kCalm = 86;
  Talk talk_{dispatcher_, *world_, talked_, "server", kCalm};
};

}  // namespace mpf::torture
