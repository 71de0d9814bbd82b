// SPDX-License-Identifier: MIT
// DueWrites: the objects that have something to write to their connections. They write after the
// tasks that are ready now, so that what these send shares a frame, and without a task for each:
// while a router polls, it calls run() in each turn and after it has looked for answers; otherwise
// one task writes for all.
//
// Threads  that of the event loop.
#pragma once

#include <kj/timer.h>
#include <vector>

#include "router/fatal_tasks.h"

namespace mpf::router {

class DueWriter {
 public:
  // Writes what is there.
  virtual void writeDue() noexcept = 0;

 protected:
  ~DueWriter() = default;
};

class DueWrites {
 public:
  // `timer` outlives this object.
  explicit DueWrites(kj::Timer& timer) noexcept : timer_(timer) {}
  ~DueWrites() noexcept = default;

  // `writer` writes soon. Do not add it again before its writeDue() was called.
  void add(DueWriter& writer);
  // Call it before the writer is destroyed, whether it was added or not.
  void remove(DueWriter& writer) noexcept;
  // Writes now. What is added meanwhile waits for the next call.
  void run();
  // True: the caller calls run() in each turn. False: a task writes, also what is due already.
  void setDriven(bool isDriven);

 private:
  void runSoon();

  kj::Timer& timer_;
  std::vector<DueWriter*> due_;
  std::vector<DueWriter*> running_;  // those of this run(); nullptr: removed
  bool isDriven_ = false;
  bool hasTask_ = false;
  FatalTasks tasks_;
};

}  // namespace mpf::router
