// SPDX-License-Identifier: MIT
// Polled: a window with links, or a connection, into which a router that polls looks itself.
// PolledSet: those that were busy lately.
//
// Threads  that of the event loop.
#pragma once

#include <cstddef>
#include <vector>

namespace mpf::router {

class Polled {
 public:
  // Handles what is there.
  virtual void poll() = 0;
  // While `isPolled` is true, poll() is called in each turn, and the event loop need not be woken.
  // After a change to false, one more poll() follows.
  virtual void setPolled(bool isPolled) = 0;

 protected:
  ~Polled() = default;
};

class PolledSet {
 public:
  static constexpr std::size_t kMax = 8;  // at a time

  // If there are kMax, `polled` replaces the one whose last add() is the oldest. Does nothing
  // during the last poll() of one that is replaced.
  void add(Polled& polled);
  // Call it before the object is destroyed, whether it was added or not.
  void remove(Polled& polled) noexcept;
  // Polls each once. A poll() may add others, which are not polled yet, or remove some.
  void poll();
  // The last poll() of each may add it again, or remove others.
  void clear();

 private:
  void dropFirst();

  bool isReplacing_ = false;
  std::vector<Polled*> all_;  // the one added last is at the end
  std::vector<Polled*> round_;  // those of this poll(); nullptr: removed
};

}  // namespace mpf::router
