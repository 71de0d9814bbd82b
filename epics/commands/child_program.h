// SPDX-License-Identifier: MIT
// ChildProgram: a program of this installation that runs as a child of the IOC. It gets SIGTERM
// when the thread that started it ends, however it ends.
//
// Threads  one thread constructs the object and calls wait(); terminate(): any.
// Owner    the destructor terminates the program and waits for its end.
#pragma once

#include <sys/types.h>

#include <mutex>
#include <string>
#include <vector>

namespace mpf {

class ChildProgram {
 public:
  //   name       such as "mpf": the program in the folder bin beside the folder of this library,
  //              otherwise that in PATH
  //   arguments  without the name
  //   output     the descriptor that becomes its standard output; -1: that of the IOC
  //   throws     std::system_error if no process can be created
  ChildProgram(const std::string& name, std::vector<std::string> arguments, int output = -1);
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  // Waits for its end.
  //   returns  its exit status, 128 + the number of the signal that killed it, or 127 if there is
  //            no such program
  int wait();
  void terminate();

 private:
  std::mutex mutex_;
  pid_t pid_ = 0;  // 0: has been reaped
  int status_ = 0;
};

}  // namespace mpf
