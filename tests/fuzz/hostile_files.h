// SPDX-License-Identifier: MIT
// HostileFiles: applies the input of a fuzzer to the files of a valid system, while the code under
// test (the victim) uses them.
//
//   input = | what | file | at | value | what | file | at | value | ...
//
// An operation has 12 bytes: what (u8), file (u8), at (u16) and value (u64). Files and offsets are
// taken modulo their number and size, and `what` modulo 5:
//   0  writes `value` to word number `at`
//   1  writes the lower half of `value` to half word number `at`
//   2  writes the lowest byte of `value` to byte `at`
//   3  truncates the file to `at` bytes
//   4  runs a turn of the victim
//
// So the fuzzer starts with valid magic numbers and lengths, and changes one of them with a few
// bytes.
//
// Threads  one.
// Crash    the next fuzzer removes the files that a crashed fuzzer has left.
// Trust    any input is allowed.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <mpf/backplane.h>
#include <mpf/file_descriptor.h>

namespace mpf::test {

struct Operation {
  enum class What : std::uint8_t { word, half, byte, cut, turn };
  static constexpr std::size_t kBytes = 12;

  explicit Operation(std::span<const std::uint8_t, kBytes> bytes) noexcept
      : what(static_cast<What>(bytes[0] % 5)), file(bytes[1]) {
    std::memcpy(&at, &bytes[2], sizeof at);
    std::memcpy(&value, &bytes[4], sizeof value);
  }
  What what;
  std::uint8_t file;
  std::uint16_t at = 0;
  std::uint64_t value = 0;
};

// Creates a backplane for this fuzzer, and removes those of crashed fuzzers.
Backplane fuzzBackplane();

class HostileFiles {
 public:
  // Inputs name a file by its index in `names`.
  HostileFiles(const Backplane& backplane, const std::vector<std::string>& names);

  // Plays an input with a victim that makeVictim() returns. Calls its turn(value) for each
  // operation 4, and once more at the end. Then restores all files.
  template <class MakeVictim>
  void play(std::span<const std::uint8_t> input, MakeVictim makeVictim) {
    {
      auto victim = makeVictim();
      applyInput(input, [&](std::uint64_t value) { victim.turn(value); });
    }
    restore();
  }
  // Adds a file that was created while the input is played; later operations apply to it, too.
  void add(const std::string& name);
  [[nodiscard]] const std::string& name(std::size_t file) const {
    return files_[file % files_.size()].name;
  }
  [[nodiscard]] std::size_t count() const noexcept { return files_.size(); }

 private:
  struct File {
    std::string name;
    FileDescriptor file;
    std::vector<std::byte> before;
  };
  void applyInput(std::span<const std::uint8_t> input,
                  const std::function<void(std::uint64_t)>& turn);
  // Aborts when the victim has left a file, a descriptor or a mapping.
  void restore();
  void apply(const Operation& operation);
  void checkNothingLeft();

  Backplane backplane_;
  std::vector<File> files_;
  std::size_t lasting_;  // the number of files at the start
  std::uint64_t runs_ = 0;
  std::vector<std::string> names_;  // sorted names on the backplane between two inputs
  std::size_t used_ = 0;  // segments that are open or mapped in this process
};

}  // namespace mpf::test
