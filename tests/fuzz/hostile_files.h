// SPDX-License-Identifier: MIT
// Hostile files: a fuzzer's input, done to the files of a system that was legal, while somebody
// looks at them.
//
//   input = | what | file | at | value | what | file | at | value | ...     a deed is 12 bytes: u8,
//   u8, u16, u64
//   what    0 write `value` over the word number `at`, 1 its lower half over a half, 2 its lowest
//           byte over a byte; 3 cut the file before byte `at`; 4 the victim's turn
//           modulo 5, places modulo what there is
//
// So the fuzzer starts behind magic numbers and lengths that fit, and needs few bytes to lie about
// one of them.
//
// Threads  one.
// Crash    what a fuzzer that crashed has left, the next one removes.
// Trust    none: any input will do.
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

struct Deed {
  enum class What : std::uint8_t { word, half, byte, cut, turn };
  static constexpr std::size_t kBytes = 12;

  explicit Deed(std::span<const std::uint8_t, kBytes> bytes) noexcept
      : what(static_cast<What>(bytes[0] % 5)), file(bytes[1]) {
    std::memcpy(&at, &bytes[2], sizeof at);
    std::memcpy(&value, &bytes[4], sizeof value);
  }
  What what;
  std::uint8_t file;
  std::uint16_t at = 0;
  std::uint64_t value = 0;
};

// A backplane for one fuzzer, on which those before it leave nothing.
Backplane fuzzBackplane();

class HostileFiles {
 public:
  // Inputs name files by their place in `names`.
  HostileFiles(const Backplane& backplane, const std::vector<std::string>& names);

  // Plays an input with a victim of its own, which makeVictim() returns. It has a turn(value)
  // wherever the input says so, and one more at the end. Afterwards all files are as they were.
  template <class MakeVictim>
  void play(std::span<const std::uint8_t> input, MakeVictim makeVictim) {
    {
      auto victim = makeVictim();
      deceive(input, [&](std::uint64_t value) { victim.turn(value); });
    }
    restore();
  }
  // A file that came while the input was played; deeds reach it like the others.
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
  void deceive(std::span<const std::uint8_t> input, const std::function<void(std::uint64_t)>& turn);
  // The victim has let go of everything: when it has not, that is the end.
  void restore();
  void act(const Deed& deed);
  void checkNothingLeft();

  Backplane backplane_;
  std::vector<File> files_;
  std::size_t lasting_;  // those of the start
  std::uint64_t runs_ = 0;
  std::vector<std::string> names_;  // between two inputs: on the backplane, sorted
  std::size_t used_ = 0;  // segments open or mapped in this process
};

}  // namespace mpf::test
