// SPDX-License-Identifier: MIT
// LineTest: a Line, and a peer that the test plays: it sends bytes, and receives items as text.
//
// Threads  one, with its event loop.
#pragma once

#include <capnp/pretty-print.h>
#include <capnp/serialize-async.h>
#include <gmock/gmock.h>
#include <kj/async-io.h>
#include <memory>
#include <string>
#include <vector>

#include <mpf/message_of.h>

#include "router/transport/kj_text.h"
#include "router/transport/line.h"
#include "tests/router/frames.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using router::Carried;
using router::FarewellCode;
using router::Line;
using router::LineEnd;
using router::PeerGreeting;
using router::ProtocolError;

class LineTest : public testing::Test {
 protected:
  // A long dead time, so that the line sends pings only in tests that want them.
  LineTest() { limits_.deadTime = limits_.handshakeTime = std::chrono::minutes(10); }
  ~LineTest() noexcept override = default;

  void TearDown() override { hangUp(); }
  void hangUp() {
    sending_ = nullptr;
    running_ = nullptr;
    line_ = nullptr;
  }
  // Returns to the state before start().
  void restart() {
    hangUp();
    pipe_ = kj::newTwoWayPipe();
    peer_ = kj::mv(pipe_.ends[1]);
    said_.clear();
  }

  void start() {
    line_ = std::make_unique<Line>(kj::mv(pipe_.ends[0]), router::Security::plain,
                                   Line::Loop{io_.provider->getTimer(), writes_, polling_}, limits_,
                                   record_, events());
    running_ = line_
                   ->run([this](wire::Item::Builder item) {
                     router::fillLimits(item.initGreeting(), limits_);
                   })
                   .then([this](LineEnd end) { end_ = std::move(end.text); })
                   .eagerlyEvaluate(nullptr);
  }
  // Starts the line and exchanges greetings.
  void startGreeted(const Fill& ours = greeting()) {
    start();
    EXPECT_THAT(receive(), testing::ElementsAre(testing::HasSubstr("greeting = ")));
    send(frameOf({ours}));
    // It measures the round trip; a second ping follows at once if the host was slow.
    EXPECT_THAT(receive(), testing::AllOf(testing::Not(testing::IsEmpty()),
                                          testing::Each(testing::StartsWith("(ping = "))));
    EXPECT_THAT(said_, testing::ElementsAre("greeted"));
    said_.clear();
  }
  // Runs the event loop until no task is ready.
  void settle() { io_.waitScope.poll(); }
  void waitForEnd() {
    while (end_.empty()) io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
  }

  // ---- the peer

  // Waits until the line has read all bytes.
  void send(const Bytes& bytes) {
    peer_->write(bytes.data(), bytes.size()).wait(io_.waitScope);
    settle();
  }
  // Does not wait until the line has read the bytes.
  void beginToSend(Bytes bytes) {
    auto kept = kj::heap(std::move(bytes));
    sending_ = peer_->write(kept->data(), kept->size())
                   .attach(kj::mv(kept))
                   .then([this] { sent_ = true; })
                   .eagerlyEvaluate(nullptr);
  }
  // The items of the next frame; "end" at the end of the stream.
  std::vector<std::string> receive() {
    settle();
    auto items = receiveWhileBusy();
    settle();
    return items;
  }
  // As receive(), while some tasks are always ready.
  std::vector<std::string> receiveWhileBusy() {
    auto frame =
        capnp::tryReadMessage(*peer_, {.traversalLimitInWords = UINT64_MAX}).wait(io_.waitScope);
    std::vector<std::string> items;
    KJ_IF_MAYBE (message, frame) {
      for (const auto item : (*message)->getRoot<wire::Frame>().getItems())
        items.push_back(router::toStd(kj::str(item)));
    } else {
      items.emplace_back("end");
    }
    return items;
  }
  void close() {
    peer_->shutdownWrite();
    settle();
  }
  // Returns the farewell, which is the next frame, and closes the connection as a peer must.
  std::string farewell() {
    const auto items = receive();
    close();
    return items.size() == 1 && items[0].find("farewell") != std::string::npos
               ? items[0]
               : "none, but: " + items[0];
  }

  // ---- what the line reports

  Line::Events events() {
    return {.onGreeting = [this](const PeerGreeting&) { said_.emplace_back("greeted"); },
            .onItem =
                [this](wire::Item::Reader item) {
                  if (onItem_) onItem_(item);
                  said_.push_back(router::toStd(kj::str(item)));
                },
            .onPlain = onPlain_,
            .onPlainItems = onPlainItems_,
            .onRoom =
                [this] {
                  if (onRoom_) onRoom_();
                },
            .onHandled = onHandled_,
            .onUnsendable =
                [this](const Carried& carried, const std::string& why, wire::Item::Builder) {
                  said_.push_back("cannot send " + std::to_string(carried.requestId) + ": " + why);
                }};
  }

  static Carried request(std::uint32_t id, std::int32_t value = 0) {
    return {
        .isRequest = true, .client = 1, .requestId = id, .message = Int32Message({.value = value})};
  }

  const Watchdog watchdog_{"a line"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  router::Limits limits_;
  // Has no buffer: a write ends when its bytes have been read.
  kj::TwoWayPipe pipe_ = kj::newTwoWayPipe();
  kj::Own<kj::AsyncIoStream> peer_ = kj::mv(pipe_.ends[1]);
  layout::RouterLine row_{};
  router::PeerRecord record_{row_};
  router::DueWrites writes_{io_.provider->getTimer()};
  router::Polling* polling_ = nullptr;  // set it before start(), and hang up before it ends
  std::unique_ptr<Line> line_;
  std::vector<std::string> said_;  // what the line has reported
  std::string end_;                // why the line ended; empty: it has not
  bool sent_ = false;              // the bytes of beginToSend() have been read
  std::function<void(wire::Item::Reader)> onItem_;
  // Set them before start().
  std::function<void(router::PlainItem&)> onPlain_;
  std::function<void(const router::PlainItems&)> onPlainItems_;
  std::function<void()> onRoom_;
  std::function<void()> onHandled_;  // set it before start()

 private:
  kj::Promise<void> running_ = nullptr;
  kj::Promise<void> sending_ = nullptr;
};

}  // namespace mpf::test
