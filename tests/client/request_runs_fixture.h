// SPDX-License-Identifier: MIT
// RequestRuns: a server with a handler of several requests, and a client that sends them.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {

class RequestRuns : public ClientTest {
 protected:
  // Starts a server whose handler records the values, and answers with 100 + value.
  void start(ServerOptions options = {}) {
    startServer(options).on<Int32>([this](std::span<Int32> requests) {
      std::vector<std::int32_t> values;
      for (auto& request : requests) {
        values.push_back(request.value);
        request.value += 100;
      }
      runs_.push_back(values);
      if (onCall_) onCall_();
    });
    bind();
  }
  void send(std::int32_t value, Deadline takeBefore = Deadline::never()) {
    Int32Message request({.value = value});
    request.setClientType(10 * value);
    request.setClientExtra(-value);
    ASSERT_EQ(client_.send(std::move(request), takeBefore, &ids_.emplace_back()), SendResult::sent);
  }
  void expectReply(std::int32_t value) {
    const auto reply = next();
    ASSERT_NE(reply.tryAs<Int32>(), nullptr);
    EXPECT_EQ(reply.tryAs<Int32>()->value, 100 + value);
    EXPECT_EQ(reply.getClientType(), 10 * value);
    EXPECT_EQ(reply.getClientExtra(), -value);
    EXPECT_EQ(reply.route().requestId, ids_.at(static_cast<std::size_t>(value)));
    EXPECT_NE(reply.route().flags & kEndsRequest, 0u);
  }

  std::vector<std::vector<std::int32_t>> runs_;
  std::vector<std::uint32_t> ids_;
  std::function<void()> onCall_;
};

}  // namespace mpf::test
