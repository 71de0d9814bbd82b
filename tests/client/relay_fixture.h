// SPDX-License-Identifier: MIT
// RelayTest: a server and a client with the functions for routers, which act on behalf of others.
#pragma once

#include <utility>
#include <vector>

#include "tests/client/client_fixture.h"

namespace mpf::test {

class RelayTest : public ClientTest {
 protected:
  RelayServer& startWatched(int queueSize = 4) {
    auto& server = startServer({.queueSize = queueSize});
    server.onClient(
        [this](std::uint64_t client, bool isThere) { comings_.emplace_back(client, isThere); });
    serverRuns_ = false;
    return server;
  }
  // The next request, without a handler.
  Message take() {
    for (;;) {
      if (auto request = server_->receive()) return request;
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  void bindByHand() {
    client_.bind("device[0]/a");
    while (!client_.isConnected()) {
      EXPECT_FALSE(server_->receive());
      dispatcher_.runOnce(Deadline::after(100us));
    }
  }
  std::vector<std::pair<std::uint64_t, bool>> comings_;
};

}  // namespace mpf::test
