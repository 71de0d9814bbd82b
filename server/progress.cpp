// SPDX-License-Identifier: MIT
#include "server/progress.h"

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include "shm/handling.h"

namespace mpf {
namespace {

constexpr std::int64_t kSlowNs = 10'000;

template <class T>
constexpr bool kHasCmd = requires { T::cmd; };

// Indexed by the number of a type: whether it has a `cmd`.
template <class... T>
constexpr auto typesWithCmd(std::type_identity<std::tuple<T...>> /*types*/) {
  std::array<bool, sizeof...(T) + 1> has{};
  const auto look = [&]<class Body>(std::type_identity<Body>) {
    if constexpr (kHasCmd<Body>) {
      static_assert(offsetof(Body, cmd) == layout::kCmdOffset);
      has[static_cast<std::size_t>(Body::kType)] = true;
    }
  };
  (look(std::type_identity<T>{}), ...);
  return has;
}

bool hasCmd(MessageType type) noexcept {
  static constexpr auto kTypes = typesWithCmd(std::type_identity<MessageTypes>{});
  const auto at = static_cast<std::size_t>(type);
  return at < kTypes.size() && kTypes[at];
}

}  // namespace

void Progress::begin(MessageType type, std::int32_t cmd) noexcept {
  const Handling handling{static_cast<std::uint16_t>(type), hasCmd(type) ? cmd : 0};
  control_.handling.store(handling.word(), std::memory_order_relaxed);
  isHandling_ = true;
}

void Progress::end() noexcept {
  if (std::exchange(isHandling_, false)) control_.handling.store(0, std::memory_order_relaxed);
}

// A fast server reads the clock for the requests that are timed, at least one in 96, and for the
// first one after a sleep, a slow server for each request. So the stored time is at most
// 96 * kSlowNs too early while requests follow one another.
void Progress::note(std::int64_t nowNs) noexcept {
  const auto taken = control_.received.load(std::memory_order_relaxed);
  isDue_ = nowNs - notedAtNs_ > kSlowNs * static_cast<std::int64_t>(taken - notedTaken_);
  notedAtNs_ = nowNs;
  notedTaken_ = taken;
  control_.progressAtNs.store(static_cast<std::uint64_t>(nowNs), std::memory_order_relaxed);
}

}  // namespace mpf
