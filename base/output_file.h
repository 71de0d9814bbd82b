// SPDX-License-Identifier: MIT
// OutputFile: a file that a program writes. Every failed write throws.
//
//   OutputFile file(path);      // before the work: throws if the file cannot be written
//   ...                         // the work, which may take hours
//   file.write(text);
//   file.close();
//
// Threads  one thread.
// Crash    a call of write() is one system call, unless the system accepts only a part at once.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include <mpf/file_descriptor.h>

namespace mpf {

class OutputFile {
 public:
  // Creates the file with this mode, or opens an existing file, whose contents the first write()
  // or close() removes.
  //   throws  std::system_error, with the name of the file, if it cannot be created, opened or
  //           written (/dev/full, for example)
  explicit OutputFile(std::string path, mode_t mode = 0666);

  // Both throw std::system_error, with the name of the file, if a write fails: for example because
  // the disk is full.
  void write(std::string_view bytes);
  void close();

 private:
  std::string path_;
  FileDescriptor file_;
  bool isBegun_ = false;
};

// Replaces a file by one with this text, or creates it. A reader sees the old or the new one, never
// a part; so does the next start, when this process is killed.
//   throws  std::system_error; then the old file is there, and no part of the new one, which would
//           take space on a full disk
void replaceFile(const std::string& path, std::string_view text, mode_t mode);

}  // namespace mpf
