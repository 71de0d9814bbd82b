// SPDX-License-Identifier: MIT
// Tracee: a child under ptrace that is stopped at its k-th visit to a step, or n instructions after
// it.
//
//   Tracee victim(pid, marks);
//   victim.aim({"slot_written", 3, 17}); or victim.watch({"slot_written", "slot_published"});
//   ... victim.handle(event) ... until victim.isThere()
//   victim.kill() or victim.release()
//
// The nop instructions of the steps are replaced by breakpoint instructions in the child's own copy
// of the code. A breakpoint need not be removed to step over it, because a nop does nothing.
//
// Threads  one: only the thread that attached may use ptrace.
// Crash    when the tracer dies, the kernel kills the tracee (PTRACE_O_EXITKILL).
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
  std::uint64_t hit = 1;  // number of the visit to the step, from 1
  std::uint64_t instructions = 0;  // to execute after the step, in the same thread
  bool upToNextMark = false;  // stop at the next step if it is reached earlier
};

class Tracee {
 public:
  // Attaches to a child of this process, which must be waiting.
  //   throws  std::system_error when tracing is not permitted, std::runtime_error on a processor
  //           other than x86-64
  Tracee(pid_t pid, const Marks& marks);

  // Counts the visits to each of these steps.
  void watch(const std::set<std::string>& marks);
  // Chooses the place at which the process is stopped.
  void aim(Place place);
  // Handles a status that waitpid() returned for one of its threads.
  void handle(pid_t thread, int status);

  [[nodiscard]] pid_t pid() const noexcept { return pid_; }
  // Whether the process is stopped at the place.
  [[nodiscard]] bool isThere() const noexcept { return stopped_ != 0; }
  // Whether the process and all its threads have ended.
  [[nodiscard]] bool isGone() const noexcept { return isGone_; }
  // The status from waitpid(), after isGone().
  [[nodiscard]] int status() const noexcept { return status_; }
  // Whether the process reached the next step before it had executed all instructions, and was
  // stopped there.
  [[nodiscard]] bool cameToNextMark() const noexcept { return atNextMark_; }
  // The number of visits to each watched step.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& hits() const noexcept { return hits_; }

  void kill() const noexcept;
  // Resumes the process and removes all breakpoints.
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
  Place place_;  // no mark: the process is not stopped anywhere
  std::vector<Marks::Address> patched_;
  std::map<std::string, std::uint64_t> hits_;
  pid_t stepping_ = 0;  // thread that executes single instructions from the mark to the place
  std::uint64_t left_ = 0;  // number of them that remain
  pid_t stopped_ = 0;  // thread that is stopped at the place
  bool released_ = false;
  bool atNextMark_ = false;
  bool isGone_ = false;
  int status_ = 0;
};

}  // namespace mpf::torture
