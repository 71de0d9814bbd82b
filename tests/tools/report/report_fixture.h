// SPDX-License-Identifier: MIT
// ReportTest: a server and a client in one thread, so that messages wait until a test handles them.
#pragma once

#include "tests/tools/tools_fixture.h"

namespace mpf::test {

class ReportTest : public ToolsTest {
 protected:
  void openServer(const std::string& name, int queueSize = 100) {
    server_ = std::make_unique<MessageServer>(backplane_, name,
                                              ServerOptions{.location = 0, .queueSize = queueSize});
    server_->on<Int32>([](Int32&) {});
  }
  void connect() {
    if (!dispatcher_) dispatcher_ = std::make_unique<Dispatcher>(backplane_);
    client_ = std::make_unique<MessageClient>(*dispatcher_, [this](const Message&) { ++taken_; });
    client_->bind(server_->getName(), 0);
    while (!client_->isConnected()) {
      server_->handleOne();
      dispatcher_->runOnce(Deadline::after(100us));
    }
  }
  [[nodiscard]] SendResult send() const { return client_->send(Int32Message()); }
  void handle(int requests) {
    for (int done = 0; done < requests;) done += server_->handleOne() ? 1 : 0;
  }
  void TearDown() override {
    client_.reset();
    dispatcher_.reset();
    server_.reset();
    ToolsTest::TearDown();
  }

  int taken_ = 0;
  std::unique_ptr<MessageServer> server_;
  std::unique_ptr<Dispatcher> dispatcher_;
  std::unique_ptr<MessageClient> client_;
};

}  // namespace mpf::test
