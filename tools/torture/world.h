// SPDX-License-Identifier: MIT
// World: memory that the referee and the actors of `mpf torture` share through fork(), independent
// of the backplane. The referee writes orders, the actors write reports.
//
// Threads  any; each word has one writer, except complaints and values, which use atomic exchange.
// Crash    the reports of an actor that is killed stay.
#pragma once

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

namespace mpf::torture {

// What a client received from servers of one name.
struct Talked {
  std::atomic<std::uint64_t> replies{0};
  std::atomic<std::uint64_t> server{0};  // incarnation of the last one that it connected to
  std::atomic<std::uint64_t> disconnects{0};
};

// The orders to one actor and its reports.
struct Board {
  // orders
  std::atomic<std::uint32_t> rest{0};   // send no new requests
  std::atomic<std::uint32_t> leave{0};  // exit
  // reports
  std::atomic<std::uint32_t> isAtRest{0};   // the actor sends nothing and has no open request
  std::atomic<std::uint32_t> isLeaving{0};  // the actor is exiting
  std::atomic<std::uint64_t> open{0};       // requests that have not ended
  std::atomic<std::uint64_t> incarnation{0};  // of a server, once it is open
  std::array<Talked, 2> talked;             // with the steady server, with the mortal one

  // Resets the board for the next actor of this kind.
  void clear() noexcept;
};

class World {
 public:
  Board survivor;  // the client that is never killed
  Board steady;    // the server that is never killed
  Board mortal;    // the server under test, and its successors
  Board visitor;   // the client under test

  const pid_t referee = ::getpid();
  std::atomic<std::uint32_t> isOver{0};

  // Reports that something does not hold. The first complaint is kept.
  void complain(std::string_view text) noexcept;
  // The first complaint; empty without one.
  [[nodiscard]] std::string complaint() const;

  // A value that no other request has.
  [[nodiscard]] std::int32_t nextValue() noexcept { return lastValue_.fetch_add(1) + 1; }
  // Records that a server acted on a request, or that a client got a fate which says that no server
  // did. Complains if both happen to one request, or if a server acts twice.
  void noteHandled(std::int32_t value) noexcept;
  void noteNeverTaken(std::int32_t value) noexcept;

 private:
  using Values = std::array<std::atomic<std::int32_t>, 65536>;  // indexed by value modulo the size
  static std::atomic<std::int32_t>& at(Values& values, std::int32_t value) noexcept;
  std::atomic<std::int32_t> lastValue_{0};
  Values handled_{};
  Values neverTaken_{};
  std::atomic<std::uint32_t> complained_{0};  // 1: a process is writing a complaint; 2: written
  std::array<char, 256> complaint_{};
};

// Owns the World of this process and of the processes that it forks.
class SharedWorld {
 public:
  SharedWorld();
  ~SharedWorld();  // sets World::isOver
  SharedWorld(const SharedWorld&) = delete;
  SharedWorld& operator=(const SharedWorld&) = delete;
  [[nodiscard]] World& operator*() const noexcept { return *world_; }

 private:
  World* world_;
};

}  // namespace mpf::torture
