// SPDX-License-Identifier: MIT
#include "crate/config/write_crate.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sstream>
#include <toml++/toml.h>

#include "base/number.h"
#include "crate/config/program_kinds.h"

namespace mpf::crate {
namespace {

std::string tomlText(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

std::string keyText(const std::string& key) {
  constexpr std::string_view kBare =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  return !key.empty() && key.find_first_not_of(kBare) == std::string::npos ? key : tomlText(key);
}

// A number is written without quotes.
std::string valueText(const std::string& value) {
  const auto number = tryNumber<std::int64_t>(value);
  return number && fmt::to_string(*number) == value ? value : tomlText(value);
}

// "a,0,,20" as { server = "a", first = 0, queue = 20 }.
std::string fieldsText(const std::string& value, const OptionKind& option) {
  const auto fields = fieldsOf(value);
  if (fields.size() > option.fields.size()) return tomlText(value);
  std::vector<std::string> pairs;
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (!fields[i].empty())
      pairs.push_back(fmt::format("{} = {}", keyText(option.fields[i]), valueText(fields[i])));
  return fmt::format("{{ {} }}", fmt::join(pairs, ", "));
}

std::string settingText(const std::string& value, const OptionKind* option) {
  if (option == nullptr) return valueText(value);
  if (option->isFlag) return value;
  return option->fields.empty() ? valueText(value) : fieldsText(value, *option);
}

std::string listText(const std::vector<std::string>& texts) {
  std::vector<std::string> all;
  for (const auto& text : texts) all.push_back(tomlText(text));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

class CrateWriter {
 public:
  std::string write(const Crate& crate, const std::string& heading) {
    addComment(heading);
    addLine("name = {}", tomlText(crate.name));
    if (!crate.backplane.empty()) addLine("backplane = {}", tomlText(crate.backplane));
    if (crate.location != 0) addLine("location = {}", crate.location);
    if (!crate.user.empty()) addLine("user = {}", tomlText(crate.user));
    for (const auto& setting : crate.defaults) addSetting(setting, nullptr);
    if (!crate.carriers.empty()) text_ += "\n[carriers]\n";
    for (const auto& carrier : crate.carriers) {
      addComment(carrier.comment);
      addLine("{} = {}", keyText(carrier.name), tomlText(carrier.kind));
    }
    for (const auto& process : crate.processes) addProcess(process, crate);
    return std::move(text_);
  }

 private:
  template <typename... T>
  void addLine(fmt::format_string<T...> format, T&&... values) {
    text_ += fmt::format(format, std::forward<T>(values)...) + "\n";
  }

  void addComment(const std::string& comment) {
    std::istringstream lines(comment);
    for (std::string line; std::getline(lines, line);) {
      std::erase_if(line, [](char one) {
        const auto byte = static_cast<unsigned char>(one);
        return byte < ' ' || byte >= 0x7f;  // TOML allows no control characters
      });
      addLine("# {}", line);
    }
  }

  void addSetting(const Setting& setting, const OptionKind* option) {
    if (setting.values.size() == 1) {
      addLine("{} = {}", setting.key, settingText(setting.values.front(), option));
      return;
    }
    addLine("{} = [", setting.key);
    for (const auto& value : setting.values) addLine("  {},", settingText(value, option));
    addLine("]");
  }

  void addProcess(const Process& process, const Crate& crate) {
    text_ += "\n";
    addComment(process.comment);
    const auto* const kind = process.kind.empty() ? nullptr : findKind(process.kind);
    addLine("[[{}]]", kind == nullptr                ? "program"
                      : kind->entry == Entry::server ? "server"
                                                     : process.kind);
    if (kind != nullptr && kind->entry == Entry::server)
      addLine("program = {}", tomlText(process.kind));
    addLine("name = {}", tomlText(process.name));
    for (const auto& setting : process.settings) addSetting(setting, kind->findOption(setting.key));
    if (!process.command.empty())
      addLine("{} = {}", kind == nullptr ? "command" : "arguments", listText(process.command));
    if (kind == nullptr && process.notifies) addLine("notify = true");
    if (!process.servers.empty()) addLine("servers = {}", listText(process.servers));
    if (!process.needs.empty()) addLine("needs = {}", listText(process.needs));
    if (!process.user.empty()) addLine("user = {}", tomlText(process.user));
    if (!process.workingFolder.empty())
      addLine("working-folder = {}", tomlText(process.workingFolder));
    if (process.location && *process.location != crate.location)
      addLine("location = {}", *process.location);
    if (process.supervision.restart == Restart::never) addLine("restart = \"never\"");
    if (process.supervision.restart == Restart::onFailure) addLine("restart = \"on-failure\"");
    addEnvironment(process.environment);
  }

  void addEnvironment(const std::map<std::string, std::string>& environment) {
    std::vector<std::string> pairs;
    for (const auto& [name, value] : environment)
      pairs.push_back(fmt::format("{} = {}", keyText(name), tomlText(value)));
    if (!pairs.empty()) addLine("environment = {{ {} }}", fmt::join(pairs, ", "));
  }

  std::string text_;
};

}  // namespace

std::string writeCrate(const Crate& crate, const std::string& heading) {
  return CrateWriter().write(crate, heading);
}

}  // namespace mpf::crate
