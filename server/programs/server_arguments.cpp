// SPDX-License-Identifier: MIT
#include "server/programs/server_arguments.h"

#include <CLI/CLI.hpp>
#include <map>
#include <stdexcept>

#include "base/command_line.h"
#include "server/programs/server_log.h"
#include "shm/link.h"
#include "shm/rights_text.h"

namespace mpf {
namespace {

constexpr int kDefaultQueueSize = 20;
const std::map<std::string, WaitMode> kWaitModes{
    {"spin", WaitMode::spin}, {"adaptive", WaitMode::adaptive}, {"block", WaitMode::block}};

// Sets `into` to the value of `option` as `parse` reads it.
template <class Value>
void take(const char* option, const std::string& text, Value (*parse)(const std::string&),
          Value& into) try {
  into = parse(text);
} catch (const std::invalid_argument& error) {
  throw CLI::ValidationError(option, error.what());
}

}  // namespace

void ServerArguments::addQueueSizeTo(CLI::App& app) {
  messages.queueSize = kDefaultQueueSize;
  messages.stampsReplies = true;
  app.add_option("queuesize", messages.queueSize, "Requests of one client that may wait")
      ->capture_default_str()
      ->check(wholeNumber(1, LinkGeometry::kMaxQueueSize));
}

void ServerArguments::addTo(CLI::App& app) {
  app.add_option("--backplane", backplane, "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  app.add_option("--location", messages.location, "Location; default: $MPF_LOCATION, or 0");
  app.add_option_function<std::string>(
         "--wait-mode",
         [this](const std::string& name) { messages.waitMode = kWaitModes.at(name); },
         "How it waits for requests: spin uses a whole processor, block sleeps immediately, "
         "adaptive spins for a while and then sleeps")
      ->check(CLI::IsMember(kWaitModes))
      ->default_str("adaptive");
  auto* const mode = app.add_option_function<std::string>(
                            "--mode",
                            [this](const std::string& text) {
                              take("--mode", text, parseMode, messages.rights.mode);
                            },
                            "Which users may be clients, octal as for chmod: 0600 the user of the "
                            "server, 0660 also the group, 0666 all users")
                         ->default_str("0600");
  app.add_option_function<std::string>(
         "--group",
         [this](const std::string& name) {
           take("--group", name, parseGroup, messages.rights.group);
         },
         "Group of --mode; default: the user's primary group")
      ->needs(mode);
  app.add_option("--log-level", logLevel, "Lowest level of log lines on stderr")
      ->check(CLI::IsMember(ServerLog::levels()))
      ->capture_default_str();
  app.add_flag("--check", checkOnly,
               "Only check the arguments; opens no device. Exit status 2: one is wrong");
}

}  // namespace mpf
