// SPDX-License-Identifier: MIT
// Value: what a symbol, an argument or a result is in a startup file.
//
//   9600, 0x80, 'N'   integer      "a-Serial[0]"   string        &ipmv162  address
//   .5                real         malloc(256)     string        NoSuch    undefined
//   result of a command            opaque          of a command that failed  unavailable
//
// On vxWorks a string is a pointer: after `s = malloc(99); t = s`, both are the same memory.
//
// Threads  one.
#pragma once

#include <any>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace mpf::startup {

// The memory behind a string. A capacity is not allocated; only `text` is.
struct StringMemory {
  std::string text;
  std::uint64_t capacity = 0;  // argument of malloc(), or the length of a literal + 1
  bool isFreed = false;
};

class Value {
 public:
  enum class Kind {
    integer,
    real,
    string,
    address,  // &name
    opaque,  // the result of a command, for other commands
    undefined,  // an undefined symbol: name()
    unavailable  // the result of a command that failed or was skipped, which has been reported
  };

  Value() = default;  // the integer 0, as a missing argument
  static Value ofInteger(std::int64_t integer);
  static Value ofReal(double real);
  static Value ofString(std::string text);
  static Value ofMemory(std::shared_ptr<StringMemory> memory, std::size_t offset = 0);
  static Value ofAddress(std::string name);
  static Value ofOpaque(std::any handle);
  static Value undefined(std::string name);
  static Value unavailable();
  // A word of the iocsh dialect, with or without quotes: a number when all of it is one. text()
  // returns the word in either case.
  static Value ofWord(std::string word);

  [[nodiscard]] Kind kind() const noexcept { return kind_; }
  [[nodiscard]] bool is(Kind kind) const noexcept { return kind_ == kind; }
  // nullopt: another kind
  [[nodiscard]] std::optional<std::int64_t> integer() const;
  [[nodiscard]] std::optional<double> real() const;  // also of an integer
  [[nodiscard]] std::optional<std::string> text() const;  // of a string, or of a word
  // nullptr: another type. `pDAC = initDAC128V(...)` hands the handle to later commands.
  template <typename T>
  [[nodiscard]] const T* opaque() const noexcept {
    return std::any_cast<T>(&opaque_);
  }
  // Of an address or an undefined symbol.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const std::shared_ptr<StringMemory>& memory() const noexcept { return memory_; }
  [[nodiscard]] std::size_t offset() const noexcept { return offset_; }
  // For messages: `9600`, `"abc"`, `&ipmv162`, `undefined symbol NoSuch`.
  [[nodiscard]] std::string description() const;

 private:
  Kind kind_ = Kind::integer;
  std::int64_t integer_ = 0;
  double real_ = 0;
  std::string name_;
  std::optional<std::string> word_;
  std::shared_ptr<StringMemory> memory_;
  std::size_t offset_ = 0;  // into the memory
  std::any opaque_;
};

}  // namespace mpf::startup
