// SPDX-License-Identifier: MIT
// Peer: a system that carries messages from one process to another and back. MPF is one of them,
// and is compared with the others. (A peer is not the other end of a connection here.)
//
// The runner creates the object before it forks, so it may hold names but no resources. Then
// serve() or sink() runs in the server's process, and connect() and the other functions in the
// requester's process. Waits need no deadline, because the Stage has one.
//
// `touch`: send() writes every byte before it sends the request, the server reads all of them and
// writes all bytes of the reply, receive() reads all of them (touch.h). Without it each side does
// only what the transport needs.
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

  // Server: answers requests until context.stopping().
  virtual void serve(const RunContext& context) = 0;

  virtual void connect(const RunContext& context) = 0;
  // Sends one request; waits while the queue is full.
  virtual void send() = 0;
  // Waits for the next reply.
  virtual void receive() = 0;
  virtual void roundTrip() {
    send();
    receive();
  }

  // One-way traffic: sink() runs in the server's process, receives messages, and reports their
  // number with context.consumed() from time to time. flood() runs in the requester's process and
  // sends until `resume` returns false. The MPF peer connects as a client in sink() and is the
  // server in flood().
  virtual void sink(const RunContext&) {}
  virtual void flood(const RunContext&, const std::function<bool()>&) {}

  // Called by the runner: removes what killed processes left.
  virtual void removeTraces() noexcept {}
};

// Processes that a peer needs. The destructor stops them.
class Environment {
 public:
  virtual ~Environment() = default;
};

// Runs an object with start() and stop() for the lifetime of this one.
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

struct ExternalProgram;  // external_peer.h

// A kind of peer: a class, or a program of its own. `skipped` says why it cannot be measured here;
// then both may be empty.
struct PeerFamily {
  std::string name;
  std::string skipped;
  std::vector<Mode> modes;
  std::function<std::unique_ptr<Peer>(const PeerOptions&)> make;
  std::shared_ptr<const ExternalProgram> program;
  bool oneWay = false;
  int maxOutstanding = 100;
  // Starts what the peer needs; empty: nothing. Throws std::runtime_error with the reason.
  std::function<std::unique_ptr<Environment>()> start;
};

[[nodiscard]] PeerFamily mpfPeer();
// replyMany() of values, and with `inRuns` onValues(); one-way traffic only
[[nodiscard]] PeerFamily mpfBatchPeer(bool inRuns);
// values in runs: sendMany(), a handler of several requests, onValues(); outstanding requests only
[[nodiscard]] PeerFamily mpfRunPeer();
[[nodiscard]] PeerFamily boostPeer();
[[nodiscard]] PeerFamily socketPeer();
[[nodiscard]] PeerFamily zeromqPeer();
[[nodiscard]] PeerFamily iceoryxPeer();
[[nodiscard]] PeerFamily iceoryx2Peer();  // request-response
[[nodiscard]] PeerFamily iceoryx2PublishingPeer();  // publish-subscribe in both directions
[[nodiscard]] PeerFamily aeronPeer();  // the client in Java
[[nodiscard]] PeerFamily aeronClientPeer();  // the client in C

}  // namespace mpf::bench
