// SPDX-License-Identifier: MIT
// Wire: two hosts in network namespaces of their own, and the line between them, which delays,
// loses, reorders and cuts on demand.
//
//   10.77.0.1 ── tun ◄═ this process: Weather, cut() ═► tun ── 10.77.0.2
//
// Packets pass through here, so no queueing discipline of the kernel is needed. Their fate is
// random: the seed is printed (random.h).
//
// Threads  one of its own carries packets; the rest by the test's.
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

// What becomes of packets, either way. Those that overtake others skip the delay.
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

  //   throws  std::system_error: this host does not allow it (namespaces and tun devices are
  //           root's)
  Wire();
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  // For a child that is to be on one of the hosts.
  void enterNear() const { enter(near_); }
  void enterFar() const { enter(far_); }

  void behave(const Weather& weather);
  // From now on nothing passes, and nobody is told. What is on its way is lost, too.
  void cut();
  void cut(Direction direction);
  void mend();
  // Packets that were let through.
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
