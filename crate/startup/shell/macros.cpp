// SPDX-License-Identifier: MIT
#include "crate/startup/shell/macros.h"

#include <algorithm>

#include "crate/startup/shell/line_error.h"
#include "crate/startup/shell/startup_shell.h"

namespace mpf::startup {
namespace {

constexpr std::size_t kDepth = 16;

class Expansion {
 public:
  Expansion(const std::map<std::string, std::string>& values, std::set<std::string>& undefined)
      : values_(values), undefined_(undefined) {}

  [[nodiscard]] std::string expanded(std::string_view text, std::size_t depth) {
    if (depth > kDepth) throw LineError{0, "the macros of this line contain each other"};
    std::string result;
    while (!text.empty()) {
      const auto length = lengthOfMacro(text);
      result +=
          length == 0 ? std::string(1, text.front()) : replaced(text.substr(0, length), depth);
      text.remove_prefix(std::max<std::size_t>(length, 1));
      limit(result.size());
    }
    return result;
  }

 private:
  // The length of $(...) or ${...} at the beginning of the text, or 0.
  static std::size_t lengthOfMacro(std::string_view text) {
    if (text.size() < 3 || text[0] != '$' || (text[1] != '(' && text[1] != '{')) return 0;
    const char open = text[1];
    const char close = open == '(' ? ')' : '}';
    std::size_t depth = 0;
    for (std::size_t i = 1; i < text.size(); ++i) {
      if (text[i] == open) ++depth;
      if (text[i] == close && --depth == 0) return i + 1;
    }
    return 0;
  }

  std::string replaced(std::string_view macro, std::size_t depth) {
    const auto inside = macro.substr(2, macro.size() - 3);
    const auto equals = inside.find('=');
    const auto name = expanded(inside.substr(0, equals), depth + 1);
    if (const auto found = values_.find(name); found != values_.end())
      return expanded(found->second, depth + 1);
    if (equals != std::string_view::npos) return expanded(inside.substr(equals + 1), depth + 1);
    undefined_.insert(name);
    return std::string(macro);
  }

  // Counts what all steps produce, so that values that contain each other often end early.
  void limit(std::size_t bytes) {
    constexpr auto kLimit = StartupShell::Limits::kLineBytes;
    if (bytes > kLimit || ++steps_ > 4 * kLimit)
      throw LineError{0, "the line is too long after its macros are replaced"};
  }

  const std::map<std::string, std::string>& values_;
  std::set<std::string>& undefined_;
  std::size_t steps_ = 0;
};

}  // namespace

std::string expandMacros(std::string_view text, const std::map<std::string, std::string>& values,
                         std::set<std::string>& undefined) {
  return Expansion(values, undefined).expanded(text, 0);
}

}  // namespace mpf::startup
