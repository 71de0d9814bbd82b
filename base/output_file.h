// SPDX-License-Identifier: MIT
// OutputFile: a file that a program writes, in which no failed write goes unnoticed.
//
//   OutputFile file(path);      // before the work: throws when nothing can be written there
//   ...                         // the work, which may take hours
//   file.write(text);
//   file.close();
//
// Threads  one.
// Crash    a call of write() is one call of the system, as far as the system takes it at once.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include <mpf/file_descriptor.h>

namespace mpf {

class OutputFile {
 public:
  // Creates the file with these rights, or opens it; what it holds goes with the first write().
  //   throws  std::system_error that names the file: it cannot be created, opened or written, such
  //           as /dev/full
  explicit OutputFile(std::string path, mode_t mode = 0666);

  // Both throw std::system_error that names the file, when the disk is full, say.
  void write(std::string_view bytes);
  void close();

 private:
  std::string path_;
  FileDescriptor file_;
  bool isBegun_ = false;
};

}  // namespace mpf
