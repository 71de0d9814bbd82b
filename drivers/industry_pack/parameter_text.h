// SPDX-License-Identifier: MIT
// ParameterText: reads a carrier's parameter string from left to right. What cannot be is an error that names the board, the string and the part.
//
//   const auto base = text.hex("I/O address", {.multipleOf = 0x400, .most = 0xfc00});
//   if (text.trySkip(',')) ...
//
// Blanks before each part are skipped.
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
  ParameterText(std::string_view board, std::string_view text) noexcept : board_(board), whole_(text), rest_(text) {}

  [[nodiscard]] bool atEnd() noexcept { return peek() == '\0'; }
  // The next character that is no blank; '\0' at the end.
  [[nodiscard]] char peek() noexcept;
  // The next character, whatever it is. Not at the end.
  char take() noexcept;
  bool trySkip(char character) noexcept;
  // `after` is what stands before it, for the message.
  void expect(char character, std::string_view after);
  void expectEnd();
  // Whether a number follows `separator`; then that is skipped.
  bool trySkipBeforeNumber(char separator) noexcept;
  // Letters, as they are; empty when none are next.
  [[nodiscard]] std::string_view word() noexcept;
  [[nodiscard]] std::string_view rest() const noexcept { return rest_; }

  // With or without 0x.
  [[nodiscard]] std::uint32_t hex(std::string_view what, const ParameterLimits& limits = {});
  // Decimal; hexadecimal with 0x.
  [[nodiscard]] std::uint32_t number(std::string_view what, const ParameterLimits& limits = {});
  // A VME interrupt level, 0 to 7.
  [[nodiscard]] int level(std::string_view what);

  //   throws  IndustryPackError: `VIPC616 "6001": ` and then `problem`
  [[noreturn]] void refuse(const std::string& problem, IndustryPackStatus status = IndustryPackStatus::badAddress) const;

 private:
  [[nodiscard]] std::uint32_t digits(std::string_view what, int base, const ParameterLimits& limits);

  std::string_view board_;
  std::string_view whole_;
  std::string_view rest_;
};

}  // namespace mpf
