// SPDX-License-Identifier: MIT
// Statistics: the state and the counters of a router's connections, in a shared-memory segment that
// `mpf mrr` and other tools read.
//
// Threads  that of the event loop.
// Crash    the router locks the segment while it runs. After a crash, the removal of stale segments
//          removes it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <mpf/backplane.h>

#include "shm/histogram.h"
#include "shm/segment.h"

namespace mpf::router {

// One row of the segment. Counters are written in place. When all rows are in use, further
// connections count in memory of the process, which no tool sees.
class PeerRecord {
 public:
  explicit PeerRecord(layout::RouterLine& line) noexcept : line_(line) {}

  layout::RouterLine* operator->() noexcept { return &line_; }
  const layout::RouterLine* operator->() const noexcept { return &line_; }
  void setState(layout::RouterLineState state) noexcept;
  void setPeer(const std::string& name, const std::string& program) noexcept;
  void setAddress(const std::string& address) noexcept;
  void setLocations(const std::vector<std::int32_t>& locations);
  // Sets why there is no connection; empty: connected, or no reason is known.
  void setProblem(const std::string& problem) noexcept;
  void clear() noexcept;

 private:
  template <std::size_t n>
  void setText(std::array<char, n>& to, const std::string& text) noexcept;
  layout::RouterLine& line_;
};

class Statistics {
 public:
  //   name    the name of this router
  //   throws  std::system_error
  Statistics(const Backplane& backplane, const std::string& name);
  ~Statistics();
  Statistics(const Statistics&) = delete;
  Statistics& operator=(const Statistics&) = delete;

  // Returns a row for as long as the pointer exists. All fields but role, state, sinceNs and isTls
  // are zero.
  [[nodiscard]] std::shared_ptr<PeerRecord> add(layout::RouterRole role);

 private:
  Segment segment_;
  std::vector<std::size_t> free_;
};

}  // namespace mpf::router
