// SPDX-License-Identifier: MIT
// Wire: two hosts in network namespaces of their own, and the line between them, which can delay,
// lose and reorder packets, and can be cut.
//
//   10.77.0.1 ── tun ◄═ this process: Weather, cut() ═► tun ── 10.77.0.2
//
// This process forwards the packets, so no queueing discipline of the kernel is needed. Losses and
// delays are random; the seed is printed (random.h).
//
// Threads  a thread of its own forwards packets; only the test's thread calls the functions.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "tests/support/random.h"

namespace mpf::test {

// How packets are treated, in both directions. A packet that overtakes others skips the delay.
struct Weather {
  std::chrono::milliseconds delay{0};
  int lostPerThousand = 0;
  int overtakingPerThousand = 0;
};

enum class Direction { toFar, toNear };

class Wire {
 public:
  static constexpr const char* kNear = "10.77.0.1";
  static constexpr const char* kFar = "10.77.0.2";

  //   throws  std::system_error if this host does not permit it: namespaces and tun devices need
  //           root
  Wire();
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  // Moves a child process to one of the hosts; to be called in the child.
  void enterNear() const { enter(near_); }
  void enterFar() const { enter(far_); }

  void behave(const Weather& weather);
  // Cuts the line: from now on all packets are lost, also those on their way. Neither side is
  // notified.
  void cut();
  void cut(Direction direction);
  void mend();
  // Number of packets forwarded.
  [[nodiscard]] std::uint64_t passed() const;

 private:
  struct Host {
    FileDescriptor tun;
    FileDescriptor network;
  };
  struct Packet {
    Direction direction;
    std::vector<char> bytes;
  };
  static Host makeHost(const char* address);
  static void enter(const Host& host);
  void run(const std::stop_token& stop);
  void take(Direction direction, const Host& from);
  void passDue();
  [[nodiscard]] int msToNext() const;
  [[nodiscard]] bool& isCut(Direction direction) {
    return direction == Direction::toFar ? cutToFar_ : cutToNear_;
  }

  Host near_;
  Host far_;
  FileDescriptor bell_;
  mutable std::mutex mutex_;
  Weather weather_;  // all below under mutex_
  bool cutToFar_ = false;
  bool cutToNear_ = false;
  std::multimap<std::int64_t, Packet> onTheirWay_;  // by the time when they are due
  std::uint64_t passed_ = 0;
  Random random_;
  std::jthread thread_;
};

}  // namespace mpf::test
