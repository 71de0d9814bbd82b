// SPDX-License-Identifier: MIT
// RouterScene: the environment of a router's parts, in memory where possible. FarEnd: the peer of
// one line.
//
// Threads  one, with its event loop.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <map>
#include <utility>

#include "router/router_context.h"
#include "router/transport/frame_reader.h"
#include "shm/watcher.h"
#include "tests/fuzz/choices.h"
#include "tests/router/rogue/random_items.h"

namespace mpf::test {

struct RouterScene {
  RouterScene();
  ~RouterScene() { backplane.watcher().forget(names); }
  RouterScene(const RouterScene&) = delete;
  RouterScene& operator=(const RouterScene&) = delete;
  // Runs the event loop until no task is ready.
  void settle() { io.waitScope.poll(); }

  kj::AsyncIoContext io = kj::setupAsyncIo();
  Backplane backplane;
  router::Statistics statistics;
  std::function<void()> onServers = [] {};  // called when servers may have started or ended
  router::ServerMonitors monitors{backplane, io.unixEventPort, [this] { onServers(); }};
  router::RouterContext context;
  // Keeps the watch open, because starting and ending a watch takes longer than the rest of an
  // input.
  Watcher::Token names = backplane.watcher().watchNames(NameKind::pendingBind, [] {});
};

// Makes the two ends of a connection: ends[0] for the router, which accepts socket options, and
// ends[1] for its peer.
kj::TwoWayPipe makeConnection();

// Sends frames, and checks what the router sends: each frame must be valid, and each request must
// end once.
class FarEnd {
 public:
  FarEnd(kj::Own<kj::AsyncIoStream> stream, RandomItems<Choices>& items);

  // Sends a frame that the input chooses.
  void send();
  // Sends `bytes` after those that still wait.
  void send(Bytes bytes);
  void setReading(bool reads);
  // Whether the router has closed the connection.
  [[nodiscard]] bool isOver() const noexcept { return over_; }

 private:
  kj::Promise<void> readLoop();
  void note(wire::Item::Reader item);
  void noteSent(const Bytes& bytes);

  kj::Own<kj::AsyncIoStream> stream_;
  RandomItems<Choices>& items_;
  router::FrameReader reader_;
  router::FrameReader sent_;
  // The number of pending requests of a client and id.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> asked_;
  bool sentIsValid_ = true;
  bool over_ = false;
  bool reading_ = true;
  kj::Own<kj::PromiseFulfiller<void>> resumeReading_;
  kj::Promise<void> writes_ = kj::READY_NOW;
  kj::Promise<void> reads_ = nullptr;
};

}  // namespace mpf::test
