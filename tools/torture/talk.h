// SPDX-License-Identifier: MIT
// Talk: one client's conversation with one server: requests of all sizes, kept, late and cancelled
// ones, and an account of their ends.
//
//   each request that is sent ends exactly once: with the reply that belongs to it, or with a fate
//   that is true
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

// What an Int32 asks of a server, in `cmd`.
enum class Request : std::int32_t {
  answer = 1,
  keep = 2,  // answer when the next one comes, or drop it
  die = 3,  // the server kills itself
};

class Talk {
 public:
  // Binds to `server`. `talked` takes the counts.
  Talk(Dispatcher& dispatcher, World& world, Talked& talked, const std::string& server,
       std::uint32_t seed);

  // Sends until some requests are open, as far as it is possible now.
  void sendSome();
  void tellToDie();
  [[nodiscard]] bool isConnected() const noexcept { return client_.isConnected(); }
  [[nodiscard]] std::size_t open() const noexcept { return open_.size(); }
  // For a look whether the referee finds it: the next fate is not told to anybody.
  void loseNextFate() noexcept { losing_ = true; }

 private:
  [[nodiscard]] bool sendOne();
  [[nodiscard]] Message makeMessage(std::int32_t value);
  [[nodiscard]] Message makeArray(std::int32_t value, std::size_t length, bool inPool);
  void take(const Message& message);
  void takeConnect(ConnectStatus status);
  void takeFate(std::int32_t value, Fate fate);
  void takeReply(std::int32_t value, const Message& reply);

  World& world_;
  Talked& talked_;
  std::mt19937 random_;
  std::map<std::uint32_t, std::int32_t> open_;  // values by request id
  bool losing_ = false;
  MessageClient client_;  // last: its callback uses the rest
};

// What a server makes of a value, and what an array holds.
[[nodiscard]] constexpr std::int32_t answerTo(std::int32_t value) noexcept { return ~value; }
[[nodiscard]] constexpr double elementOf(std::int32_t value, std::size_t index) noexcept {
  return value + 0.5 * static_cast<double>(index);
}
// Whether `array` is what was made from `value`.
[[nodiscard]] bool holds(std::span<const double> array, std::int32_t value) noexcept;

}  // namespace mpf::torture
