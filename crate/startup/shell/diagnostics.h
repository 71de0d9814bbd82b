// SPDX-License-Identifier: MIT
// Diagnostics: all errors, warnings and notes about startup files, so that their author corrects
// them at once.
//
//   st.cmd:12:17: error: undefined symbol carrier2
//     initIpacCarrier(carrier2, 0)
//                     ^
//
// Threads  one.
// Trust    texts of files are made printable; the number of diagnostics is limited.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace mpf::startup {

struct Place {
  std::string file;
  std::size_t line = 0;    // from 1
  std::size_t column = 0;  // from 1; 0: the whole line

  [[nodiscard]] std::string text() const;  // "FILE:LINE:COLUMN"
  bool operator==(const Place&) const = default;
};

enum class Severity { note, warning, error };

struct Diagnostic {
  Severity severity = Severity::error;
  Place place;
  std::vector<Place> includedFrom;  // the `<` lines that led to the file, the outermost first
  std::string text;
  std::string line;  // of the file; formatted() makes it printable

  // As in the picture above.
  [[nodiscard]] std::string formatted() const;
};

class Diagnostics {
 public:
  // Further ones are counted and not kept.
  static constexpr std::size_t kMaxKept = 1000;

  void add(Diagnostic diagnostic);
  // Counts a command that is not executed.
  void countSkipped() noexcept { ++skipped_; }
  [[nodiscard]] int skipped() const noexcept { return skipped_; }
  [[nodiscard]] const std::vector<Diagnostic>& all() const noexcept { return all_; }
  [[nodiscard]] std::size_t count(Severity severity) const noexcept;
  [[nodiscard]] bool hasErrors() const noexcept { return count(Severity::error) > 0; }

 private:
  std::vector<Diagnostic> all_;
  std::size_t counts_[3]{};  // by Severity, with those that are not kept
  int skipped_ = 0;
};

}  // namespace mpf::startup
