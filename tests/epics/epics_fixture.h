// SPDX-License-Identifier: MIT
// EpicsTest: a backplane that the IOC uses, and servers in threads of the test.
#pragma once

#include <atomic>
#include <cstdlib>
#include <functional>
#include <memory>
#include <thread>

#include <mpf/message_server.h>

#include "tests/epics/ioc.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

// A server with a thread, which calls `handler` for each request.
class ThreadServer {
 public:
  using Handler = std::function<void(MessageServer&, Message&&)>;
  ThreadServer(const Backplane& backplane, const std::string& name, Handler handler,
               const ServerOptions& options = {})
      : server_(backplane, name, options), thread_([this, handler = std::move(handler)] {
          while (!isOver_) {
            server_.waitForMessage(Deadline::after(std::chrono::milliseconds(10)));
            while (auto request = server_.receive()) handler(server_, std::move(request));
          }
        }) {}
  ~ThreadServer() { isOver_ = true; }
  ThreadServer(const ThreadServer&) = delete;
  ThreadServer& operator=(const ThreadServer&) = delete;

 private:
  MessageServer server_;
  std::atomic<bool> isOver_{false};
  std::jthread thread_;
};

class EpicsTest : public testing::Test {
 protected:
  EpicsTest() { ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1); }
  TestBackplane backplane_;
  const Watchdog watchdog_{"EPICS test"};
};

}  // namespace mpf::test
