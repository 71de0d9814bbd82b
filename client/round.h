// SPDX-License-Identifier: MIT
// Round: visits bindings of a dispatcher, some in each step. Thousands of bindings may have to
// reconnect at once; messages of other clients are delivered between the steps.
//
// Threads  one. Callbacks may call resume() again and destroy clients.
#pragma once

#include <memory>
#include <utility>
#include <vector>

namespace mpf {

template <class Binding>
class Round {
 public:
  static constexpr int kPerStep = 8;

  // Starts a round through these bindings; a round in progress is dropped.
  void begin(std::vector<std::weak_ptr<Binding>> bindings) {
    bindings_ = std::move(bindings);
    next_ = 0;
  }
  [[nodiscard]] bool isOver() const noexcept { return bindings_.empty(); }
  // Calls `act` for one binding after the other until it has returned true for kPerStep of them.
  template <class Act>
  void resume(const Act& act) {
    for (int acted = 0; acted < kPerStep && next_ < bindings_.size();) {
      const auto binding = bindings_[next_++].lock();
      if (binding && act(*binding)) ++acted;
    }
    if (next_ >= bindings_.size()) begin({});  // release the references
  }

 private:
  std::vector<std::weak_ptr<Binding>> bindings_;
  std::size_t next_ = 0;
};

}  // namespace mpf
