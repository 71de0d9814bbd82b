// SPDX-License-Identifier: MIT
// Wrapping: texts in the columns of the terminal, or in 80.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mpf::tools {

inline constexpr std::size_t kColumns = 80;

// The columns that a line may take: kColumns, unless fitToTerminal() was called on a terminal.
[[nodiscard]] std::size_t lineColumns() noexcept;
// Takes the width of the terminal on stdout, at least 40 columns, for all lines of this process.
// Changes nothing when stdout is no terminal. For main(), before anything is printed.
void fitToTerminal() noexcept;

// The columns that a text takes.
[[nodiscard]] std::size_t columnsOf(const std::string& text);

// `first` and then the words of `text`, broken between words, and inside a word that is longer than
// a line; each further line is indented by `indent` blanks. Ends with a newline.
[[nodiscard]] std::string wrap(const std::string& first, const std::string& text,
                               std::size_t indent);

// "1 client", "2 clients"; `many` for what does not end in "s".
[[nodiscard]] std::string counted(std::uint64_t count, const std::string& one,
                                  const std::string& many = {});

// A text of at most so many columns; what is longer ends in "~".
[[nodiscard]] std::string cut(const std::string& text, std::size_t columns);

}  // namespace mpf::tools
