// SPDX-License-Identifier: MIT
#include "crate/startup/shell/iocsh_line.h"

#include <cctype>
#include <string>
#include <utility>
#include <vector>

#include "crate/startup/shell/line_error.h"

namespace mpf::startup {
namespace {

struct Word {
  std::string text;
  std::size_t column = 0;
  bool isQuoted = false;
};

bool isSeparator(char c) { return std::string_view(" \t(),\r").find(c) != std::string_view::npos; }

class Splitter {
 public:
  explicit Splitter(std::string_view line) : line_(line) {}

  // Words, and "<", ">" and ">>" as words of their own.
  [[nodiscard]] std::vector<Word> words() {
    std::vector<Word> words;
    for (;;) {
      while (at_ < line_.size() && isSeparator(line_[at_])) ++at_;
      if (at_ >= line_.size()) return words;
      words.push_back(isRedirection() ? readRedirection() : readWord());
    }
  }

 private:
  [[nodiscard]] bool isRedirection() const {
    const auto rest = line_.substr(at_);
    const bool isOfDescriptor =
        rest.size() > 1 && rest[0] >= '1' && rest[0] <= '9' && rest[1] == '>';
    return rest.front() == '<' || rest.front() == '>' || isOfDescriptor;
  }
  Word readRedirection() {
    Word word{line_[at_] == '<' ? "<" : ">", at_ + 1, false};
    if (line_[at_] != '<' && line_[at_] != '>') ++at_;
    ++at_;
    if (word.text == ">" && at_ < line_.size() && line_[at_] == '>') ++at_;
    return word;
  }
  // Inside quotes, every character stands for itself; outside, one after a backslash does.
  Word readWord() {
    Word word{"", at_ + 1, false};
    char quote = 0;
    for (; at_ < line_.size(); ++at_) {
      const char c = line_[at_];
      if (quote == 0 && (isSeparator(c) || c == '<' || c == '>')) return word;
      if (quote == 0 && (c == '"' || c == '\'')) {
        quote = c;
        word.isQuoted = true;
      } else if (quote != 0 && c == quote) {
        quote = 0;
      } else if (quote == 0 && c == '\\' && at_ + 1 < line_.size()) {
        word.text += line_[++at_];
      } else {
        word.text += c;
      }
    }
    if (quote != 0) throw LineError{word.column, "a quotation mark is not closed in this line"};
    return word;
  }

  std::string_view line_;
  std::size_t at_ = 0;
};

Value valueOf(const Word& word) {
  if (!word.isQuoted && word.text.size() > 1 && word.text.front() == '&')
    return Value::ofAddress(word.text.substr(1));
  return Value::ofWord(word.text);
}

}  // namespace

void executeIocshLine(std::string_view line, LineActions& actions) {
  auto words = Splitter(line).words();
  if (words.empty() || words.front().text.starts_with('#')) return;
  const auto isRedirection = [](const Word& word) {
    return !word.isQuoted && (word.text == "<" || word.text == ">");
  };
  std::vector<Argument> arguments;
  const bool isInclude = isRedirection(words.front());
  for (std::size_t i = isInclude ? 0 : 1; i < words.size(); ++i) {
    if (!isRedirection(words[i])) {
      arguments.push_back({valueOf(words[i]), words[i].column});
      continue;
    }
    const auto& redirection = words[i];
    if (++i == words.size()) throw LineError{redirection.column, "the name of a file is expected"};
    if (redirection.text == "<")
      arguments.push_back({Value::ofString(words[i].text), words[i].column});
    else actions.report(Severity::note, redirection.column, "the output is not written to a file");
  }
  if (!isInclude)
    static_cast<void>(actions.call(words.front().text, std::move(arguments), words.front().column));
  else if (!arguments.empty())
    actions.include(arguments.front().value.text().value_or(""), words.front().column);
}

}  // namespace mpf::startup
