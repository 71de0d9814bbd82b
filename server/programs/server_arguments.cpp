// SPDX-License-Identifier: MIT
#include <mpf/server/programs/server_arguments.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <charconv>
#include <fmt/format.h>
#include <grp.h>
#include <map>
#include <vector>

#include <mpf/server/programs/server_log.h>

namespace mpf {
namespace {

constexpr mode_t kAnybodyReadsAndWrites = 0666;
constexpr mode_t kOwnerReadsAndWrites = 0600;

const std::map<std::string, WaitMode> kWaitModes{{"spin", WaitMode::spin}, {"adaptive", WaitMode::adaptive}, {"block", WaitMode::block}};

mode_t modeOf(const std::string& text) {
  mode_t mode = 0;
  const auto* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, mode, 8);
  if (error == std::errc() && stopped == end && (mode & ~kAnybodyReadsAndWrites) == 0 &&
      (mode & kOwnerReadsAndWrites) == kOwnerReadsAndWrites) {
    return mode;
  }
  throw CLI::ValidationError("--mode", fmt::format("{}: use an octal number between 0600 and 0666, such as 0660", text));
}

std::uint32_t groupOf(const std::string& name) {
  group entry{};
  group* found = nullptr;
  std::vector<char> room(1024);
  while (::getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &found) == ERANGE) room.resize(2 * room.size());
  if (found == nullptr) throw CLI::ValidationError("--group", fmt::format("{}: there is no group of this name", name));
  return found->gr_gid;
}

}  // namespace

void ServerArguments::addTo(CLI::App& app) {
  app.add_option("--backplane", backplane, "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  app.add_option("--location", messages.location, "Location; default: $MPF_LOCATION, or 0");
  app.add_option_function<std::string>(
         "--wait-mode", [this](const std::string& name) { messages.waitMode = kWaitModes.at(name); },
         "How it waits for requests: spin takes a processor, block sleeps at once, adaptive spins for a while")
      ->check(CLI::IsMember(kWaitModes))
      ->default_str("adaptive");
  auto* const mode = app.add_option_function<std::string>(
                            "--mode", [this](const std::string& text) { messages.rights.mode = modeOf(text); },
                            "Who may be a client, octal as for chmod: 0600 its own user, 0660 also the group, 0666 everybody")
                         ->default_str("0600");
  app.add_option_function<std::string>(
         "--group", [this](const std::string& name) { messages.rights.group = groupOf(name); },
         "The group that --mode speaks of; default: the user's own")
      ->needs(mode);
  app.add_option("--log-level", logLevel, "Least weight of what it says on stderr")
      ->check(CLI::IsMember(ServerLog::levels()))
      ->capture_default_str();
}

}  // namespace mpf
