// SPDX-License-Identifier: MIT
// Wrapping of texts to the width of the terminal, or to 80 columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mpf::tools {

inline constexpr std::size_t kColumns = 80;

// The columns that a line may have: kColumns, unless fitToTerminal() found a terminal.
[[nodiscard]] std::size_t lineColumns() noexcept;
// Sets lineColumns() to the width of the terminal on stdout, but at least to 40. Changes nothing
// when stdout is not a terminal. main() calls it before the program prints anything.
void fitToTerminal() noexcept;

// The columns that a text occupies.
[[nodiscard]] std::size_t columnsOf(const std::string& text);

// `first` and then the words of `text`. Lines are broken between words; a word that is longer than
// a line is broken inside. Each further line is indented by `indent` blanks. Ends with a newline.
[[nodiscard]] std::string wrap(const std::string& first, const std::string& text,
                               std::size_t indent);

// "1 client", "2 clients"; `many` is the plural when it is not `one` + "s".
[[nodiscard]] std::string counted(std::uint64_t count, const std::string& one,
                                  const std::string& many = {});

// A text of at most `columns` columns; a longer text is cut and ends in "~".
[[nodiscard]] std::string cut(const std::string& text, std::size_t columns);

}  // namespace mpf::tools
