// SPDX-License-Identifier: MIT
// OneLinkTest: a server "dac" and a client in one thread, so that messages wait until a test
// handles them. The server increments Int32 and sends arrays back.
#pragma once

#include <memory>
#include <string>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "tests/shm/shm_fixture.h"

namespace mpf::test {

class OneLinkTest : public ShmTest {
 protected:
  void TearDown() override {
    client_.reset();
    dispatcher_.reset();
    server_.reset();
    ShmTest::TearDown();
  }

  void openServer(int queueSize = 20) {
    server_ = std::make_unique<MessageServer>(backplane_, "dac",
                                              ServerOptions{.location = 2, .queueSize = queueSize});
    server_->on<Int32>([](Int32& request) { ++request.value; });
    server_->on<Float64Array>([](Float64ArrayMessage&) {});
  }
  void connectClient() {
    if (!dispatcher_) dispatcher_ = std::make_unique<Dispatcher>(backplane_);
    client_ = std::make_unique<MessageClient>(*dispatcher_, [this](const Message&) { ++taken_; });
    client_->bind("dac", 2);
    while (!client_->isConnected()) {
      server_->handleOne();
      dispatcher_->runOnce(Deadline::after(100us));
    }
    taken_ = 0;  // the message `connect` does not count
  }
  void connect(int queueSize = 20) {
    openServer(queueSize);
    connectClient();
  }
  void sendValue(std::int32_t value) const {
    ASSERT_EQ(client_->send(Int32Message({.address = 7, .value = value})), SendResult::sent);
  }
  // Sends an array that is too large for the ring: its body is in a pool.
  void sendArray(double first) const {
    auto array = client_->alloc<Float64Array>(1000);
    array.value()[0] = first;
    ASSERT_EQ(client_->send(std::move(array)), SendResult::sent);
  }
  // The server handles this number of requests, and replies to them.
  void handle(int requests) const {
    for (int done = 0; done < requests;) done += server_->handleOne() ? 1 : 0;
  }
  // The client takes messages until it has received this number of replies.
  void takeReplies(int replies) const {
    while (taken_ < replies) dispatcher_->runOnce(Deadline::after(100us));
  }

  // The name of the only link's segment.
  [[nodiscard]] std::string linkName() const {
    for (const auto& each : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(each);
      if (parsed && parsed->kind == NameKind::link) return each;
    }
    return "no link";
  }
  // Opens a segment of this backplane for writing, to put invalid data into it.
  [[nodiscard]] static Segment openForWriting(const std::string& segment,
                                              layout::SegmentKind kind) {
    return std::move(*Segment::tryOpen(segment, kind, Segment::Access::readWrite));
  }

  std::unique_ptr<MessageServer> server_;
  std::unique_ptr<Dispatcher> dispatcher_;
  std::unique_ptr<MessageClient> client_;
  int taken_ = 0;
};

}  // namespace mpf::test
