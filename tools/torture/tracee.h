// SPDX-License-Identifier: MIT
// Tracee: a child under ptrace that is stopped at the k-th time that it comes to a step, or n
// instructions behind it.
//
//   Tracee victim(pid, marks);       stopped
//   victim.aim({"slot_written", 3, 17}); or victim.watch({"slot_written", "slot_published"});
//   ... victim.handle(event) ... until victim.isThere()
//   victim.kill() or victim.release()
//
// The child's nops become breakpoint instructions, in its own copy of the text. A breakpoint is
// never lifted to step over it: what it replaced did nothing.
//
// Threads  one: the kernel knows the tracing thread.
// Crash    when the tracer dies, its tracee does (PTRACE_O_EXITKILL).
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "tools/torture/marks.h"

namespace mpf::torture {

// A place in a run of a program.
struct Place {
  std::string mark;
  std::uint64_t hit = 1;  // the how-many-th time it comes there
  std::uint64_t instructions = 0;  // further, in the same thread
  bool upToNextMark = false;  // and not past another step
};

class Tracee {
 public:
  // Takes hold of a child of ours, which waits for something.
  //   throws  std::system_error when this is not allowed, std::runtime_error on a processor that it
  //           does not know
  Tracee(pid_t pid, const Marks& marks);

  // Counts how often it comes to each of these steps.
  void watch(const std::set<std::string>& marks);
  // Stops it there.
  void aim(Place place);
  // What waitpid() told about a thread of it.
  void handle(pid_t thread, int status);

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  // Stopped at the place.
  [[nodiscard]] bool isThere() const noexcept { return stopped_ != 0; }
  // Ended, and so are all its threads.
  [[nodiscard]] bool isGone() const noexcept { return isGone_; }
  // As waitpid() tells it, of a tracee that is gone.
  [[nodiscard]] int status() const noexcept { return status_; }
  // It came to the next step before so many instructions were over, and was stopped there.
  [[nodiscard]] bool cameToNextMark() const noexcept { return atNextMark_; }
  // How often it came to each step that was watched.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& hits() const noexcept { return hits_; }

  void kill() const noexcept;
  // Goes on from the place, to its end.
  void release();

 private:
  void onTrap(pid_t thread);
  void onMark(pid_t thread, const std::string& mark);
  void onInstruction(pid_t thread);
  void arrive(pid_t thread) noexcept;
  void resume(pid_t thread, int signal = 0) const noexcept;
  void patch(Marks::Address address, char instruction) const;

  pid_t pid_;
  const Marks& marks_;
  FileDescriptor memory_;
  Place place_;  // without mark: nowhere
  std::vector<Marks::Address> patched_;
  std::map<std::string, std::uint64_t> hits_;
  pid_t stepping_ = 0;  // thread that walks from the mark to the place
  std::uint64_t left_ = 0;
  pid_t stopped_ = 0;  // thread that is there
  bool released_ = false;
  bool atNextMark_ = false;
  bool isGone_ = false;
  int status_ = 0;
};

}  // namespace mpf::torture
