// SPDX-License-Identifier: MIT
// RouterPartsTest: parts of a router that use one Line, with a backplane; the test plays the peer.
//
// Threads  one, with its event loop, which also runs servers and clients of the backplane.
#pragma once

#include <mpf/message_client.h>

#include "router/router_context.h"
#include "tests/router/transport/line_fixture.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {

class RouterPartsTest : public LineTest {
 protected:
  // Runs the event loop until `isDone`.
  void runUntil(const std::function<bool()>& isDone) {
    while (!isDone()) io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
  }
  // The next item of the line, as text.
  std::string nextItem() {
    if (items_.empty()) {
      const auto frame = receive();
      items_.insert(items_.end(), frame.begin(), frame.end());
    }
    auto item = items_.front();
    items_.erase(items_.begin());
    return item;
  }

  const TestBackplane backplane_;
  std::string logged_;
  router::Statistics statistics_{backplane_, "test"};
  router::ServerMonitors monitors_{backplane_, io_.unixEventPort, [] {}};
  router::RouterContext context_{
      .port = io_.unixEventPort,
      .network = io_.provider->getNetwork(),
      .timer = io_.provider->getTimer(),
      .backplane = backplane_,
      .log = Log([this](Log::Level, const std::string& text) { logged_ += text + '\n'; }),
      .statistics = statistics_,
      .monitors = monitors_,
      .config = {},
      .tls = nullptr};

 private:
  std::vector<std::string> items_;  // of a frame
};

}  // namespace mpf::test
