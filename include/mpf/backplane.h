// SPDX-License-Identifier: MIT
// Backplane: a named set of processes on one host. Clients find only servers on their own
// backplane.
//
//   auto backplane = mpf::Backplane::attach();  // MPF_BACKPLANE, or "default"
//   mpf::MessageServer server(backplane, "echo");
//
// A backplane has no process and no file of its own: it consists of the segments in /dev/shm whose
// names begin with "mpf.<backplane>.".
//
// A Backplane object is a handle: copies are cheap and share one watcher thread, which detects the
// death of peers and starts when the first client or server needs it.
//
// Threads  any thread may use any copy.
// Crash    attach() removes segments of dead processes. The kernel's locks prove that their owners
//          are dead.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <mpf/detail/cpp20.h>

namespace mpf {

class Watcher;  // internal

class Backplane {
 public:
  // Attaches to the backplane `name`, which need not have any process yet, and removes the segments
  // of dead processes. If the backplane has more than 1024 files, it examines 1024 of them, chosen
  // at random.
  //   name    1 to 39 of the characters A-Z a-z 0-9 _ -; empty: the environment variable
  //           MPF_BACKPLANE, or "default" if that is not set
  //   throws  std::invalid_argument if the name is invalid, std::system_error if /dev/shm cannot be
  //           read or no file descriptor is free
  static Backplane attach(const std::string& name = {});
  // As attach(), but removes nothing: for callers that only report.
  static Backplane named(const std::string& name);
  // A backplane with a new, random name. For tests that must not meet other processes.
  static Backplane isolated();

  [[nodiscard]] const std::string& name() const noexcept;
  // Internal: the watcher that all copies share. The child of a fork makes its own at the first
  // call.
  //   throws  std::system_error, std::bad_alloc: only that first call
  [[nodiscard]] Watcher& watcher() const;

  // The location of servers and clients that do not set one: the environment variable MPF_LOCATION,
  // or 0 if that is not set.
  //   throws  std::invalid_argument if MPF_LOCATION is not a 32-bit integer
  static std::int32_t defaultLocation();

  // Removes every segment of this backplane whose owner is proven dead.
  //   returns  the names of the removed files, without folder
  //   throws   std::system_error if /dev/shm cannot be read
  std::vector<std::string> removeDead() const;
  // Lists the files of this backplane, in no particular order and without folder.
  //   throws  std::system_error if /dev/shm cannot be read
  [[nodiscard]] std::vector<std::string> segmentNames() const;
  // Lists, sorted, the backplanes that have segments on this host.
  //   throws  std::system_error if /dev/shm cannot be read
  static std::vector<std::string> names();

 private:
  struct State;
  explicit Backplane(std::string name);
  std::shared_ptr<State> state_;
};

}  // namespace mpf
