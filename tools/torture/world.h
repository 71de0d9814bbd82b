// SPDX-License-Identifier: MIT
// World: what the processes of a torture tell each other beside the backplane, in memory that
// fork() shares. The referee orders, the actors report.
//
// Threads  any; each word has one writer, but complaints and values, which are exchanged.
// Crash    an actor that is killed leaves what it has reported.
#pragma once

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

namespace mpf::torture {

// What has come of a conversation of a client with a server.
struct Talked {
  std::atomic<std::uint64_t> replies{0};
  std::atomic<std::uint64_t> connects{0};
  std::atomic<std::uint64_t> disconnects{0};
};

// Of one actor.
struct Board {
  // orders
  std::atomic<std::uint32_t> rest{0};  // send nothing new
  std::atomic<std::uint32_t> leave{0};  // end in order
  // reports
  std::atomic<std::uint32_t> isAtRest{0};  // nothing is sent, nothing is open
  std::atomic<std::uint32_t> isLeaving{0};  // on its way out
  std::atomic<std::uint64_t> open{0};  // requests that have no end yet
  std::array<Talked, 2> talked;  // with the steady server, with the mortal one

  // For the next actor of this part.
  void clear() noexcept;
};

class World {
 public:
  Board survivor;  // the client that goes on
  Board steady;  // the server that goes on
  Board mortal;  // the server that dies and has successors
  Board visitor;  // the client that dies

  const pid_t referee = ::getpid();
  std::atomic<std::uint32_t> isOver{0};

  // The first complaint is kept.
  void complain(std::string_view text) noexcept;
  // Empty when nobody has complained.
  [[nodiscard]] std::string complaint() const;

  // A value that no other request has.
  [[nodiscard]] std::int32_t nextValue() noexcept { return lastValue_.fetch_add(1) + 1; }
  // A server acts on a request, a client is told that nobody has: who contradicts another
  // complains, and so does who acts a second time.
  void noteHandled(std::int32_t value) noexcept;
  void noteNeverTaken(std::int32_t value) noexcept;

 private:
  using Values = std::array<std::atomic<std::int32_t>, 65536>;  // each at its value mod the size
  static std::atomic<std::int32_t>& at(Values& values, std::int32_t value) noexcept;
  std::atomic<std::int32_t> lastValue_{0};
  Values handled_{};
  Values neverTaken_{};
  std::atomic<std::uint32_t> complained_{0};  // 1: somebody writes, 2: it is written
  std::array<char, 256> complaint_{};
};

// The one world of this process and those that it forks.
class SharedWorld {
 public:
  SharedWorld();
  ~SharedWorld();
  SharedWorld(const SharedWorld&) = delete;
  SharedWorld& operator=(const SharedWorld&) = delete;
  [[nodiscard]] World& operator*() const noexcept { return *world_; }

 private:
  World* world_;
};

}  // namespace mpf::torture
