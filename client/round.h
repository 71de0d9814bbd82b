// SPDX-License-Identifier: MIT
// Round: all bindings of a dispatcher, some in each step. There may be thousands that have to
// connect anew, and others have their turn meanwhile.
//
// Threads  one. Callbacks may come back in here, and destroy clients.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "client/binding.h"

namespace mpf {

class Round {
 public:
  // From the beginning, with those that there are now.
  void begin(const std::set<std::shared_ptr<Binding>>& all) {
    bindings_.assign(all.begin(), all.end());
    next_ = 0;
  }
  [[nodiscard]] bool isOver() const noexcept { return next_ == bindings_.size(); }
  // Goes on until `act` has had something to do, and said so, for some of them.
  template <class Act>
  void resume(const Act& act) {
    for (int acted = 0; acted < kInAStep && !isOver();) {
      const auto binding = bindings_[next_++].lock();
      if (binding && act(*binding)) ++acted;
    }
    if (isOver()) begin({});  // nobody's memory waits for the next one
  }

 private:
  static constexpr int kInAStep = 8;
  std::vector<std::weak_ptr<Binding>> bindings_;
  std::size_t next_ = 0;
};

}  // namespace mpf
