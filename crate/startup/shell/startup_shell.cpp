// SPDX-License-Identifier: MIT
#include "crate/startup/shell/startup_shell.h"

#include <algorithm>
#include <fmt/format.h>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "crate/startup/shell/iocsh_line.h"
#include "crate/startup/shell/line_actions.h"
#include "crate/startup/shell/line_error.h"
#include "crate/startup/shell/macros.h"
#include "crate/startup/shell/shell_commands.h"
#include "crate/startup/shell/startup_file.h"
#include "crate/startup/shell/string_functions.h"
#include "crate/startup/shell/vxworks_line.h"

namespace mpf::startup {
namespace {

bool isControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (byte < 0x20 && c != '\t' && c != '\r' && c != '\f') || byte == 0x7F;
}

void checkLine(std::string_view line) {
  if (line.size() > StartupShell::Limits::kLineBytes)
    throw LineError{
        0, fmt::format("the line has more than {} bytes", StartupShell::Limits::kLineBytes)};
  const auto* const found = std::ranges::find_if(line, isControl);
  if (found != line.end())
    throw LineError{static_cast<std::size_t>(found - line.begin()) + 1,
                    "a command must not contain control characters: remove this one"};
}

bool isComment(std::string_view line) {
  const auto begin = line.find_first_not_of(" \t");
  return begin == std::string_view::npos || line[begin] == '#';
}

}  // namespace

// Executes one file. The files that include it are executing, too.
class StartupShell::Execution final : public LineActions {
 public:
  Execution(StartupShell& shell, std::filesystem::path path, const Execution* from,
            std::size_t column)
      : shell_(shell), path_(std::move(path)), from_(from) {
    if (from != nullptr) {
      includedFrom_ = from->includedFrom_;
      includedFrom_.push_back(from->place(column));
    }
  }

  void execute() try {
    const auto file = StartupFile::read(path_);
    const auto inherited = from_ == nullptr ? Dialect::vxWorks : from_->dialect_;
    dialect_ = shell_.forced_.value_or(detectDialect(file.content, inherited));
    for (const auto line : file.lines) {
      ++number_;
      executeLine(line);
    }
  } catch (const std::runtime_error& error) {
    reportUnreadable(error.what());
  }

  Value call(const std::string& name, std::vector<Argument> arguments,
             std::size_t column) override {
    if (isExpanded_)
      for (auto& argument : arguments) argument.column = 0;
    const Command command{name,    std::move(arguments), place(column), includedFrom_, line_,
                          dialect_};
    if (dialect_ == Dialect::vxWorks && command.arguments.size() > Limits::kArguments)
      report(Severity::warning, command.arguments[Limits::kArguments].column,
             fmt::format("vxWorks passes only the first {} arguments", Limits::kArguments));
    if (auto result = tryStringFunction(command, shell_.state_, *this)) return *result;
    if (auto result = tryShellCommand(command, shell_.state_, *this)) return *result;
    if (auto result = shell_.handler_.tryExecute(command, shell_)) return *result;
    shell_.diagnostics_.countSkipped();
    report(Severity::warning, column, "unknown command " + name + "; it is skipped");
    return Value::unavailable();
  }

  void include(const std::string& file, std::size_t column) override {
    shell_.executeFile(file, this, column);
  }

  void report(Severity severity, std::size_t column, const std::string& text) override {
    shell_.diagnostics_.add({severity, place(column), includedFrom_, text, line_});
  }

  std::map<std::string, Value>& symbols() override { return shell_.state_.symbols; }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const Execution* from() const { return from_; }
  [[nodiscard]] std::size_t depth() const { return includedFrom_.size(); }

 private:
  // Columns of a line whose macros were replaced are not those of the file.
  [[nodiscard]] Place place(std::size_t column) const {
    return {path_.string(), number_, isExpanded_ ? 0 : column};
  }

  void executeLine(std::string_view line) try {
    line_ = line.substr(0, Limits::kLineBytes);
    isExpanded_ = false;
    checkLine(line);
    if (isComment(line)) return;
    if (dialect_ == Dialect::iocsh) executeIocshLine(expanded(), *this);
    else VxWorksLine(line, *this).execute();
  } catch (const LineError& error) {
    report(Severity::error, error.column, error.text);
  }

  std::string expanded() {
    std::set<std::string> undefined;
    auto text = expandMacros(line_, shell_.state_.environment, undefined);
    isExpanded_ = text != line_;
    for (const auto& name : undefined)
      report(Severity::warning, 0,
             fmt::format("the macro {} has no value: set it with epicsEnvSet", name));
    return text;
  }

  void reportUnreadable(const std::string& reason) {
    std::error_code error;
    const bool isOfSite = isFileOfSite(path_) && !std::filesystem::exists(path_, error);
    const auto severity = isOfSite ? Severity::note : Severity::error;
    auto text = fmt::format("{}: {}", path_.string(), reason);
    if (isOfSite) text += "; each site generates or writes its own";
    Diagnostic diagnostic;
    diagnostic.severity = severity;
    if (from_ == nullptr) {
      diagnostic.place.file = path_.string();
      diagnostic.text = reason;
    } else {
      diagnostic.includedFrom = includedFrom_;
      diagnostic.place = diagnostic.includedFrom.back();
      diagnostic.includedFrom.pop_back();
      diagnostic.text = text;
      diagnostic.line = from_->line_;
    }
    shell_.diagnostics_.add(std::move(diagnostic));
  }

  StartupShell& shell_;
  std::filesystem::path path_;
  const Execution* from_;
  std::vector<Place> includedFrom_;
  Dialect dialect_ = Dialect::vxWorks;
  std::string line_;
  std::size_t number_ = 0;  // of the line
  bool isExpanded_ = false;  // macros of the line were replaced
};

StartupShell::StartupShell(CommandHandler& handler, std::filesystem::path folder)
    : handler_(handler) {
  state_.startFolder = folder;
  state_.folder = std::move(folder);
}

void StartupShell::execute(const std::filesystem::path& file) { executeFile(file, nullptr, 0); }

void StartupShell::executeFile(const std::filesystem::path& file, const Execution* from,
                               std::size_t column) {
  const auto refuse = [&](const std::string& text) { throw LineError{column, text}; };
  auto path = (state_.folder / file).lexically_normal();
  for (const auto* outer = from; outer != nullptr; outer = outer->from()) {
    std::error_code error;
    if (std::filesystem::equivalent(outer->path(), path, error))
      refuse(fmt::format("{} includes itself", path.string()));
  }
  if (from != nullptr && from->depth() + 1 >= Limits::kIncludeDepth)
    refuse(fmt::format("files include each other more than {} deep", Limits::kIncludeDepth));
  if (++files_ > Limits::kFiles)
    refuse(fmt::format("more than {} files are included", Limits::kFiles));
  Execution(*this, std::move(path), from, column).execute();
}

void StartupShell::report(Severity severity, const Command& command, const std::string& text) {
  diagnostics_.add({severity, command.place, command.includedFrom, text, command.text});
}

void StartupShell::reportSkipped(Severity severity, const Command& command,
                                 const std::string& text) {
  diagnostics_.countSkipped();
  report(severity, command, text);
}

void StartupShell::reportArgument(Severity severity, const Command& command, std::size_t index,
                                  const std::string& text) {
  auto place = command.place;
  if (index < command.arguments.size()) place.column = command.arguments[index].column;
  diagnostics_.add({severity, place, command.includedFrom, text, command.text});
}

}  // namespace mpf::startup
