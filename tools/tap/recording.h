// SPDX-License-Identifier: MIT
// Recording: a file of the messages that `mpf tap` saw. Its format is schema/recording.capnp.
//
// Threads  one.
// Crash    each record is written with one call. A file that ends within a record is readable up to
//          that record.
// Trust    a file is untrusted: invalid data is an error that names the file and the position.
#pragma once

#include <capnp/serialize.h>
#include <cstdint>
#include <functional>
#include <kj/io.h>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/output_file.h"
#include "schema/recording.capnp.h"

namespace mpf::tools {

class RecordingWriter {
 public:
  // Creates the file, or opens it, and checks that it can be written. Throws std::system_error.
  explicit RecordingWriter(std::string path);

  // Throws std::system_error, for example when the disk is full.
  void write(capnp::MessageBuilder& record);
  // Throws std::system_error when the file system could not store what was written.
  void close() { file_.close(); }

 private:
  OutputFile file_;
};

class RecordingReader {
 public:
  // Throws std::system_error.
  explicit RecordingReader(std::string path);

  // Hands over the next record. False at the end.
  //   throws  std::runtime_error for invalid data: "x.mpf: record 12, at byte 3456 of 5000: ..."
  bool tryNext(const std::function<void(wire::Record::Reader)>& take);

  // The position of the last record: "x.mpf: record 12, at byte 3456 of 5000".
  [[nodiscard]] std::string place() const;

 private:
  std::string path_;
  FileDescriptor file_;
  kj::FdInputStream stream_;
  kj::BufferedInputStreamWrapper buffered_;
  capnp::ReaderOptions limits_;  // a message cannot be larger than the file
  std::uint64_t number_ = 0;
  std::uint64_t bytes_ = 0;  // size of the file
  std::uint64_t begin_ = 0;  // offset of the record in the file
};

}  // namespace mpf::tools
