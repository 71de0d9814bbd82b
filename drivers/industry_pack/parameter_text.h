// SPDX-License-Identifier: MIT
// ParameterText: reads the parameter string of a carrier from left to right. An error names the
// board, the string and the invalid part.
//
//   const auto base = text.hex("I/O address", {.multipleOf = 0x400, .most = 0xfc00});
//   if (text.trySkip(',')) ...
//
// Blanks before each part are skipped.
//
// Threads  one at a time.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {

struct ParameterLimits {
  std::uint32_t multipleOf = 1;
  std::uint32_t least = 0;
  std::uint32_t most = UINT32_MAX;
};

class ParameterText {
 public:
  ParameterText(std::string_view board, std::string_view text) noexcept
      : board_(board), whole_(text), rest_(text) {}

  [[nodiscard]] bool atEnd() noexcept { return peek() == '\0'; }
  // Returns the next character that is not a blank, without taking it; '\0' at the end.
  [[nodiscard]] char peek() noexcept;
  // Takes the next character, also a blank. Must not be called at the end.
  char take() noexcept;
  // Takes `character` if it is next.
  bool trySkip(char character) noexcept;
  // Takes `character`; it is an error if another one is next. `after` names the part before it, for
  // the message.
  void expect(char character, std::string_view after);
  void expectEnd();
  // Takes `separator` if it is next and a number follows.
  bool trySkipBeforeNumber(char separator) noexcept;
  // Takes the letters that are next; empty if there are no letters.
  [[nodiscard]] std::string_view word() noexcept;
  [[nodiscard]] std::string_view rest() const noexcept { return rest_; }

  // Takes a hexadecimal number, with or without 0x. `what` names it in error messages.
  [[nodiscard]] std::uint32_t hex(std::string_view what, const ParameterLimits& limits = {});
  // Takes a decimal number, or a hexadecimal one with 0x.
  [[nodiscard]] std::uint32_t number(std::string_view what, const ParameterLimits& limits = {});
  // Takes a VME interrupt level, 0 to 7.
  [[nodiscard]] int level(std::string_view what);

  //   throws  IndustryPackError with the board, the whole string and `problem`: `VIPC616 "6001":
  //           ...`
  [[noreturn]] void refuse(const std::string& problem,
                           IndustryPackStatus status = IndustryPackStatus::badAddress) const;

 private:
  [[nodiscard]] std::uint32_t digits(std::string_view what, int base,
                                     const ParameterLimits& limits);

  std::string_view board_;
  std::string_view whole_;
  std::string_view rest_;
};

}  // namespace mpf
