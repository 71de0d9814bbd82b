// SPDX-License-Identifier: MIT
// RouterScene: what a router's parts work with, in memory as far as it goes. FarEnd: the peer of
// one line.
//
// Threads  one, with its event loop.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <map>
#include <utility>

#include "router/surroundings.h"
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
  // All that can happen now has happened.
  void settle() { io.waitScope.poll(); }

  kj::AsyncIoContext io = kj::setupAsyncIo();
  Backplane backplane;
  router::Statistics statistics;
  std::function<void()> onServers = [] {};  // called when they may have come or gone
  router::Presences presences{backplane, io.unixEventPort, [this] { onServers(); }};
  router::Surroundings here;
  // Somebody always watches: to begin and end that takes the kernel longer than all the rest of an
  // input.
  Watcher::Token names = backplane.watcher().watchNames(NameKind::pendingBind, [] {});
};

// The two ends of a connection: one for the router, whose options can be set, and one for its peer.
kj::TwoWayPipe makeConnection();

// Sends what it is told, and reads what comes: each frame must be sound, and each request have one
// end.
class FarEnd {
 public:
  FarEnd(kj::Own<kj::AsyncIoStream> stream, RandomItems<Choices>& items);

  // One of the input's frames.
  void send();
  // Other bytes, behind those that have not gone yet.
  void send(Bytes bytes);
  void setReading(bool reads);
  // The router has closed.
  [[nodiscard]] bool isOver() const noexcept { return over_; }

 private:
  kj::Promise<void> readLoop();
  void note(wire::Item::Reader item);
  void noteSent(const Bytes& bytes);

  kj::Own<kj::AsyncIoStream> stream_;
  RandomItems<Choices>& items_;
  router::FrameReader reader_;
  router::FrameReader sent_;
  // requests of a client and id that had no end
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> asked_;
  bool knowsWhatItSent_ = true;
  bool over_ = false;
  bool reading_ = true;
  kj::Own<kj::PromiseFulfiller<void>> readOn_;
  kj::Promise<void> writes_ = kj::READY_NOW;
  kj::Promise<void> reads_ = nullptr;
};

}  // namespace mpf::test
