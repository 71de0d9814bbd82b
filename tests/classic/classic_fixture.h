// SPDX-License-Identifier: MIT
// ClassicTest: a backplane that the original API uses. ClassicServer: a server of that API, which
// serves in a thread until it has had a number of requests.
#pragma once

#include <stdlib.h>

#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <thread>

#include <mpf/classic.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

class ClassicTest : public testing::Test {
 protected:
  ClassicTest() { ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1); }
  TestBackplane backplane_;
  const Watchdog watchdog_{"test of the original API"};
};

class ClassicServer {
 public:
  // `handle` owns the request.
  using Handle = std::function<void(::MessageServer&, ::Message*)>;
  ClassicServer(const std::string& name, int requests, Handle handle)
      : server_(name.c_str(), 20), thread_([this, requests, handle = std::move(handle)] {
          for (int taken = 0; taken < requests;) {
            server_.waitForMessage();
            while (auto* request = server_.receive()) {
              handle(server_, request);
              ++taken;
            }
          }
        }) {}

 private:
  ::MessageServer server_;
  std::jthread thread_;
};

}  // namespace mpf::test
