// SPDX-License-Identifier: MIT
// Talk: the messages of one client to one server: requests of all sizes, sent alone or as a run of
// values, some of them kept, expired, cancelled, or answered with many values. It checks that each
// request ends exactly once: with its own reply, or with a true fate; and that the values of an
// answer are in order.
//
// Threads  the dispatcher's.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>

#include <mpf/message_client.h>

#include "tools/torture/world.h"

namespace mpf::torture {

// What an Int32 message asks of the server, in `cmd`.
enum class Request : std::int32_t {
  answer = 1,
  keep = 2,  // answer when the next such request arrives, or drop it
  die = 3,  // the server kills itself
  answerMany = 4,  // answer with many values, numbered in `extra`
};

class Talk {
 public:
  // Binds to `server`. Counts in `talked`.
  Talk(Dispatcher& dispatcher, World& world, Talked& talked, const std::string& server,
       std::uint32_t seed);

  // Sends requests until some are open, or the queue is full; sometimes in a burst or a run.
  void sendSome();
  // Asks the server to kill itself. Returns false if its queue is full.
  [[nodiscard]] bool trySendDie();
  [[nodiscard]] bool isConnected() const noexcept { return client_.isConnected(); }
  [[nodiscard]] std::size_t open() const noexcept { return open_.size(); }
  // Sabotage: the next fate is ignored.
  void loseNextFate() noexcept { losing_ = true; }

 private:
  void sendBurst();
  template <class T>
  [[nodiscard]] bool sendRun();
  [[nodiscard]] bool sendOne();
  [[nodiscard]] Message makeMessage(std::int32_t value);
  [[nodiscard]] Message makeArray(std::int32_t value, std::size_t length, bool inPool);
  void take(const Message& message);
  void takeValues(std::span<const Int32> values, const Message& first);
  void takeAnswers(std::span<const Int32> values);
  void takeFurther(std::span<const Int32> values);
  void takeConnect(const Connect& connect);
  void takeFate(std::int32_t value, Fate fate);
  void takeReply(std::int32_t value, const Message& reply);
  void takeNumber(std::int32_t value, std::int32_t answer);

  World& world_;
  Talked& talked_;
  std::mt19937 random_;
  using Open = std::map<std::uint32_t, std::int32_t>;  // values by request id
  Open open_;
  bool losing_ = false;
  std::uint32_t lastId_ = 0;  // of the last Int32
  Int32 last_{};
  MessageClient client_;  // last: its callback uses the rest
};

// The value of the reply to a request, and the elements of an array.
[[nodiscard]] constexpr std::int32_t answerTo(std::int32_t value) noexcept { return ~value; }
[[nodiscard]] constexpr double elementOf(std::int32_t value, std::size_t index) noexcept {
  return value + 0.5 * static_cast<double>(index);
}
// Whether the elements of `array` are those for `value`.
[[nodiscard]] bool holds(std::span<const double> array, std::int32_t value) noexcept;

}  // namespace mpf::torture
