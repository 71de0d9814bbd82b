// SPDX-License-Identifier: MIT
// Peer: a way to get messages from one process to another and back. Ours is one of them.
//
// An object is made in the runner, before the processes are; it may hold names, no resource. Then
// serve() or sink() runs in the server's process, and connect() with all that follows in the
// requester's. Waits need no deadline: the Stage has one.
//
// `touch`: send() writes every byte before it hands the request over, the server reads them all and
// writes all of the reply, receive() reads them all (touch.h). Without it each side does the least
// that the transport needs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/stage/mode.h"
#include "benchmarks/stage/stage.h"

namespace mpf::bench {

struct PeerOptions {
  Mode mode = Mode::spin;
  std::size_t bytes = 4;
  bool touch = false;
  std::string name;  // unique on this host, as part of a file's name
};

class Peer {
 public:
  virtual ~Peer() = default;

  // Server: answers requests until scene.stopping().
  virtual void serve(const Scene& scene) = 0;

  virtual void connect(const Scene& scene) = 0;
  // Sends one request; waits while there is no room.
  virtual void send() = 0;
  // Waits for the next reply.
  virtual void receive() = 0;
  virtual void roundTrip() {
    send();
    receive();
  }

  // One way: the server's process takes messages and counts them with scene.consumed(), now and
  // then at least; flood() sends until the deadline. Ours may swap the roles: what counts is that
  // one process sends and another takes.
  virtual void sink(const Scene&) {}
  virtual void flood(const Scene&, const std::function<bool()>&) {}

  // Runner: removes what killed processes left.
  virtual void removeTraces() noexcept {}
};

// A daemon that a peer needs. Stopped by its destructor.
class Environment {
 public:
  virtual ~Environment() = default;
};

// What has start() and stop(): it runs while this lives.
template <class Started>
class Running final : public Environment {
 public:
  explicit Running(std::shared_ptr<Started> started) : started_(std::move(started)) {
    started_->start();
  }
  ~Running() override { started_->stop(); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  std::shared_ptr<Started> started_;
};

// A kind of peer. `skipped` says why it cannot be measured here; then `make` may be empty.
struct PeerFamily {
  std::string name;
  std::string skipped;
  std::vector<Mode> modes;
  std::function<std::unique_ptr<Peer>(const PeerOptions&)> make;
  bool oneWay = false;
  int maxOutstanding = 100;
  // empty: needs nothing. Throws std::runtime_error with the reason
  std::function<std::unique_ptr<Environment>()> start;
};

[[nodiscard]] PeerFamily mpfPeer();
[[nodiscard]] PeerFamily boostPeer();
[[nodiscard]] PeerFamily socketPeer();
[[nodiscard]] PeerFamily zeromqPeer();
[[nodiscard]] PeerFamily iceoryxPeer();

}  // namespace mpf::bench
