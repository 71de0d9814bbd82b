// SPDX-License-Identifier: MIT
#include "router/arguments.h"

#include <fcntl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fmt/format.h>

#include "base/command_line.h"
#include "base/number.h"
#include "base/print_error.h"
#include "router/config/limit_text.h"
#include "shm/rights_text.h"

namespace mpf::router {
namespace {

constexpr const char* kProgram = "mpf-router";
constexpr const char* kFooter =
    "Examples: mpf-router /etc/mpf/router.toml\n"
    "          mpf-router --serve 1=0 --listen 10.0.0.7:9900 --plain   on the host of the servers\n"
    "          mpf-router --remote 1=10.0.0.7:9900 --plain             on the host of the clients\n"
    "SIGHUP reloads the file; connections whose entries are unchanged continue.\n"
    "Exit status: 0 stopped by SIGINT or SIGTERM; 1 failed; 2 usage error, or an error in the "
    "configuration.";

std::int32_t parseLocation(std::string_view text) {
  if (const auto location = tryNumber<std::int32_t>(text)) return *location;
  throw std::invalid_argument(fmt::format("\"{}\" is not a location: write an integer", text));
}

// Parses "1", or "1=0" for a location that has another number on this host.
Serve parseServe(const std::string& text) {
  const auto equals = text.find('=');
  const auto location = parseLocation(std::string_view(text).substr(0, equals));
  return {location, equals == std::string::npos
                        ? location
                        : parseLocation(std::string_view(text).substr(equals + 1))};
}

// Parses "1,2=ioc1.lab:9900".
Remote parseRemote(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos)
    throw std::invalid_argument(fmt::format("\"{}\": write LOCATION[,LOCATION]=HOST:PORT", text));
  Remote remote;
  for (std::size_t begin = 0, end = 0; begin <= equals; begin = end + 1) {
    end = std::min(text.find(',', begin), equals);
    remote.locations.push_back(parseLocation(std::string_view(text).substr(begin, end - begin)));
  }
  remote.address = parseAddress(text.substr(equals + 1));
  return remote;
}

// Returns why nothing can be written to a descriptor; an empty text if it is open for writing. The
// router has not opened any of its own yet.
std::string explainUnusable(const std::string& descriptor) {
  const auto number = tryNumber<int>(descriptor);
  const int flags = number ? ::fcntl(*number, F_GETFL) : -1;
  if (flags >= 0 && (flags & O_ACCMODE) != O_RDONLY) return {};
  return fmt::format("{}: not a descriptor that is open for writing", descriptor);
}

// Calls `function` and reports an invalid value as an error of `option`.
template <class Function>
void asOption(const std::string& option, Function function) try {
  function();
} catch (const std::invalid_argument& error) {
  throw CLI::ValidationError(option, error.what());
}

// Adds an option. Each of its values becomes an entry of the configuration, and its place is
// recorded.
template <class Value, class Parse>
CLI::Option* addEntries(CLI::App& app, const std::string& option, const std::string& type,
                        std::vector<Value>& values, std::vector<Places>& places, Parse parse,
                        const std::string& text) {
  const auto take = [&values, &places, option, parse](const std::vector<std::string>& words) {
    for (const auto& word : words) {
      asOption(option, [&] { values.push_back(parse(word)); });
      places.push_back({{"", fmt::format("{} {}", option, word)}});
    }
  };
  return app.add_option_function<std::vector<std::string>>(option, take, text)
      ->type_name(type)
      ->take_all()
      ->allow_extra_args(false);
}

// Servers of this host are usually at location 0, and clients look for them there.
void warnOfLocation0(const Remote& remote) {
  if (std::ranges::find(remote.locations, 0) == remote.locations.end()) return;
  printError(
      "{}: warning: location 0 of the remote {} is usually that of servers of this host; offer "
      "the servers there at another location, with --serve 1=0\n",
      kProgram, remote.address.text());
}

// Sets the value of an option that overrides the file; see RouterArguments::overrides_.
void applyOverride(WrittenConfig& to, const std::string& name, const std::string& value) {
  auto& config = to.config;
  const std::map<std::string, std::string*> texts{
      {"name", &config.name},          {"backplane", &config.backplane},
      {"log-level", &config.logLevel}, {"tls-certificate", &config.tls.certificate},
      {"tls-key", &config.tls.key},    {"tls-authorities", &config.tls.authorities}};
  if (const auto text = texts.find(name); text != texts.end()) *text->second = value;
  else if (name == "mode") config.rights.mode = parseMode(value);
  else if (name == "group") config.rights.group = parseGroup(value);
  else setLimit(config.limits, name, value, MissingUnit::seconds);
  const auto place = "--" + name;
  constexpr std::string_view kTls = "tls-";
  if (name.starts_with(kTls)) to.places.tls[name.substr(kTls.size())] = place;
  to.places.root[name] = to.places.limits[name] = place;
}

}  // namespace

std::optional<int> RouterArguments::start(int argc, const char* const* argv) {
  CLI::App app("mpf-router - joins this host's backplane with those of other hosts, over TCP",
               kProgram);
  const auto insteadOfFile = addFile(app);
  addOverrides(app);
  app.add_flag("--check", checkOnly_, "Check the configuration, print its meaning, and exit");
  app.add_option("--ready-fd", readyDescriptor_,
                 "Write the listening addresses to this descriptor, one per line, and close it")
      ->type_name("FD")
      ->check(explainUnusable);
  app.footer(kFooter);
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  try {
    for (const auto* const option : insteadOfFile) {
      if (!file_.empty() && option->count() != 0)
        throw ConfigError(
            fmt::format("{}: it cannot be combined with a configuration file; write it into {}",
                        option->get_name(), file_));
    }
    applyTransport();
    config_ = loadConfig();
  } catch (const ConfigError& error) {
    if (file_.empty()) return refuseArguments(kProgram, error.what());
    printError("{}: {}\n", kProgram, error.what());
    return 2;
  }
  for (const auto& remote : config_.remotes) warnOfLocation0(remote);
  if (!checkOnly_) return std::nullopt;
  fmt::print("{}", describe(config_));
  return 0;
}

std::vector<CLI::Option*> RouterArguments::addFile(CLI::App& app) {
  auto& [options, places] = options_;
  places.isFile = false;
  places.root = places.tls = places.limits = {{"", ""}};
  app.add_option("file", file_, "Configuration file (TOML); without it, use the options below")
      ->type_name("FILE");
  std::vector<CLI::Option*> instead{
      addEntries(
          app, "--serve", "LOCATION[=LOCAL]", options.serve, places.serve, parseServe,
          "Offer servers of this host at LOCATION to other hosts; their location here is LOCAL"),
      addEntries(
          app, "--listen", "HOST:PORT", options.listen, places.listen,
          [](const std::string& text) { return Listen{parseAddress(text)}; },
          "Accept routers of other hosts here: a host name, 10.0.0.7:9900, [fd00::7]:9900, *:9900"),
      addEntries(
          app, "--remote", "LOCATION[,LOCATION]=HOST:PORT", options.remotes, places.remotes,
          parseRemote,
          "Connect clients of this host to these locations, through the router at HOST:PORT"),
      app.add_flag("--plain", plain_, "Use plain TCP instead of TLS"),
      app.add_flag("--allow-public-plain", options.allowPublicPlain,
                   "Allow --plain also at public addresses and on all networks (*)"),
      app.add_option("--tls-name", tlsName_,
                     "Name in the certificate of the --remote; default: its host name")
          ->type_name("NAME")};
  for (auto* const option : instead) option->group("Instead of a file");
  return instead;
}

// Values are checked when they are parsed, so that an error names the option. Each loadConfig()
// applies them.
void RouterArguments::addOverrides(CLI::App& app) {
  const auto add = [&](const std::string& name, const std::string& type, const std::string& text) {
    const auto take = [this, name](const std::string& value) {
      WrittenConfig scratch;
      asOption("--" + name, [&] { applyOverride(scratch, name, value); });
      overrides_[name] = value;
    };
    app.add_option_function<std::string>("--" + name, take, text)
        ->type_name(type)
        ->group("Override the file");
  };
  add("tls-certificate", "FILE", "Certificate of this router, followed by its chain: PEM");
  add("tls-key", "FILE", "Private key of the certificate: PEM, without a password");
  add("tls-authorities", "FILE",
      "Certificates of the authorities that sign the peers' certificates: PEM");
  add("name", "NAME",
      "Name of this router, as peers and `mpf mrr` show it; default: the host name");
  add("backplane", "NAME", "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  add("mode", "MODE",
      "Which users of this host may be clients of remote servers, octal as for chmod; default: "
      "0600, the router's own user");
  add("group", "GROUP", "Group of --mode; default: the user's primary group");
  add("log-level", "LEVEL",
      "Lowest level of the messages on stderr: trace, debug, info, warning, error, critical, off; "
      "default: info");
  for (const auto& name : limitNames())
    add(name, limitType(name),
        fmt::format("{}; default: {}", limitPurpose(name), limitText({}, name)));
}

void RouterArguments::applyTransport() {
  auto& config = options_.config;
  const auto security = plain_ ? Security::plain : Security::tls;
  for (auto& listen : config.listen) listen.security = security;
  for (auto& remote : config.remotes) {
    remote.security = security;
    remote.tlsName = tlsName_;
  }
  if (!tlsName_.empty() && config.remotes.size() != 1)
    throw ConfigError(
        "--tls-name: it applies to a single --remote; for several, write a configuration file");
}

RouterConfig RouterArguments::loadConfig() const {
  auto written = file_.empty() ? options_ : readConfig(file_);
  for (const auto& [name, value] : overrides_) applyOverride(written, name, value);
  completeConfig(written);
  return written.config;
}

}  // namespace mpf::router
