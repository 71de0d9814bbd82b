// SPDX-License-Identifier: MIT
#include "base/command_line.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <limits>
#include <string_view>
#include <system_error>

#include "base/number.h"
#include "base/print_error.h"
#include "base/run_main.h"
#include "base/version.h"

namespace mpf {
namespace {

std::string subcommandsOf(const CLI::App& app) {
  std::string names;
  for (const auto* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  return names;
}

// The program and the chosen subcommands: "mpf call" for `mpf call echo`.
struct Chosen {
  const CLI::App* app;
  std::string name;
};
Chosen chosenCommand(const CLI::App& app) {
  Chosen chosen{&app, app.get_name()};
  while (!chosen.app->get_subcommands().empty()) {
    chosen.app = chosen.app->get_subcommands().front();
    chosen.name += " " + chosen.app->get_name();
  }
  return chosen;
}

// CLI11 lists unexpected arguments from the last to the first.
std::string textOf(const CLI::App& command, const CLI::ParseError& error) {
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr) return error.what();
  const auto words = command.remaining();
  auto text = fmt::format("The following argument{} not expected: {}",
                          words.size() == 1 ? " was" : "s were", fmt::join(words, " "));
  const auto isPositional = [](const CLI::Option* option) { return option->get_positional(); };
  if (!words.front().starts_with('-') && command.get_options(isPositional).empty() &&
      command.get_option_no_throw("--backplane") != nullptr)
    text += fmt::format("; a backplane is named with --backplane {}", words.front());
  return text;
}

// Adds the exit statuses to the --help text of `app` and its subcommands, which have those of `app`
// unless they have their own. The man pages are generated from that text.
void addExitStatus(CLI::App& app, std::string status) {
  const auto footer = app.get_footer();
  if (const auto at = footer.find("Exit status"); at != std::string::npos)
    status = footer.substr(at);
  else app.footer(footer + (footer.empty() ? "" : "\n") + status);
  for (auto* command : app.get_subcommands([](CLI::App*) { return true; }))
    addExitStatus(*command, status);
}

int explain(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  const auto [chosen, command] = chosenCommand(app);
  const auto subcommands = subcommandsOf(app);
  if (chosen != &app || subcommands.empty())
    return refuseArguments(command, textOf(*chosen, error));
  if (const auto words = app.remaining(); !words.empty()) {
    printError(
        "{}: unknown subcommand or option \"{}\"; the subcommands are {}; `{} --help` shows what "
        "they do\n",
        command, words.front(), subcommands, command);
  } else {
    printError("{}", app.help());
  }
  return kExitUsage;
}

// Also when no type can hold it.
bool isWholeNumber(std::string_view text) {
  if (text.starts_with('-')) text.remove_prefix(1);
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool isNumber(std::string_view text) { return tryNumber<double>(text).has_value(); }

//   kind    what a value must be: "a number"
//   isKind  whether a text is one, in the range or not
template <class Number>
CLI::Validator inRange(Number least, Number most, const char* kind,
                       bool (*isKind)(std::string_view)) {
  return CLI::Validator(
      [=](const std::string& text) {
        const auto value = tryNumber<Number>(text);
        const bool good = value && *value >= least && *value <= most;  // NaN is not
        if (good) return std::string();
        const auto what = isKind(text) ? "out of range" : fmt::format("not {}", kind);
        if (most == std::numeric_limits<Number>::max())
          return fmt::format("{} is {}: use {} or more", text, what, least);
        return fmt::format("{} is {}: use {} to {}", text, what, least, most);
      },
      {});
}

}  // namespace

std::optional<int> parseCommandLine(CLI::App& app, int argc, const char* const* argv) try {
  addExitStatus(app, "Exit status: 0 done; 1 failed, the text on stderr says why; 2 usage error.");
  app.set_version_flag("--version", fmt::format("{} {}", app.get_name(), kVersion),
                       "Print the version");
  app.parse(argc, argv);
  return std::nullopt;
} catch (const CLI::ParseError& error) {
  return explain(app, error);
}

int refuseArguments(const std::string& program, const std::string& why) {
  printError("{}: {}; `{} --help` shows how to use it\n", program, why, program);
  return kExitUsage;
}

CLI::Validator wholeNumber(std::uint64_t least, std::uint64_t most) {
  return inRange(least, most, "a whole number", isWholeNumber);
}
CLI::Validator number(double least, double most) {
  return inRange(least, most, "a number", isNumber);
}

CLI::Option* addTime(CLI::App& app, const std::string& name, Nanoseconds present,
                     const std::string& help, TimeRange range,
                     const std::function<void(Nanoseconds)>& set) {
  const auto check = [range](const std::string& text) {
    const auto time = tryTime(text, MissingUnit::seconds);
    if (!time)
      return fmt::format(
          "{} is not a time: use 200ms, 2s or 1.5min; a number without a unit is in seconds", text);
    if (*time >= range.least && *time <= range.most) return std::string();
    const auto least = range.least == kAboveZero.least ? "more than 0s" : timeText(range.least);
    if (range.most == kLongestTime) return fmt::format("{} is out of range: use {}", text, least);
    return fmt::format("{} is out of range: use {} to {}", text, least, timeText(range.most));
  };
  const auto take = [set](const std::string& text) {
    set(tryTime(text, MissingUnit::seconds).value());
  };
  return app.add_option_function<std::string>(name, take, help)
      ->check(CLI::Validator(check, {}))
      ->type_name("TIME")
      ->default_str(timeText(present));
}

}  // namespace mpf
