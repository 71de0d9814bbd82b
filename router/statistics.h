// SPDX-License-Identifier: MIT
// Statistics: what a router says of its connections, in a segment of its own, for `mpf mrr` and the
// like to read without asking it.
//
// Threads  that of the event loop.
// Crash    the segment is locked for the router's life; whoever cleans up removes it afterwards.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <mpf/backplane.h>

#include "shm/histogram.h"
#include "shm/segment.h"

namespace mpf::router {

// One row. Counters are written in place; a connection beyond those that there are rows for counts
// where nobody sees it.
class PeerRecord {
 public:
  explicit PeerRecord(layout::RouterLine& line) noexcept : line_(line) {}

  layout::RouterLine* operator->() noexcept { return &line_; }
  const layout::RouterLine* operator->() const noexcept { return &line_; }
  void setState(layout::RouterLineState state) noexcept;
  void setPeer(const std::string& name, const std::string& program) noexcept;
  void setAddress(const std::string& address) noexcept;
  void setLocations(const std::vector<std::int32_t>& locations);
  // Why there is no connection; empty: there is one, or nothing is known.
  void setProblem(const std::string& problem) noexcept;
  void clear() noexcept;

 private:
  template <std::size_t n>
  void setText(std::array<char, n>& to, const std::string& text) noexcept;
  layout::RouterLine& line_;
};

class Statistics {
 public:
  //   name  what this router calls itself
  //   throws  std::system_error
  Statistics(const Backplane& backplane, const std::string& name);
  ~Statistics();
  Statistics(const Statistics&) = delete;
  Statistics& operator=(const Statistics&) = delete;

  // A row until its holder dies; all zero but for its role.
  [[nodiscard]] std::shared_ptr<PeerRecord> add(layout::RouterRole role);

 private:
  Segment segment_;
  std::vector<std::size_t> free_;
};

}  // namespace mpf::router
