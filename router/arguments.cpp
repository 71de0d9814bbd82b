// SPDX-License-Identifier: MIT
#include "router/arguments.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <fmt/format.h>

#include "base/command_line.h"
#include "base/print_error.h"
#include "router/config/limit_text.h"
#include "shm/rights_text.h"

namespace mpf::router {
namespace {

constexpr const char* kProgram = "mpf-router";
constexpr const char* kFooter =
    "Examples: mpf-router /etc/mpf/router.toml\n"
    "          mpf-router --serve 1 --listen 10.0.0.7:9900 --plain     on the host of the servers\n"
    "          mpf-router --remote 1=10.0.0.7:9900 --plain             on the host of the clients\n"
    "SIGHUP reads the file again; connections that it does not change stay.\n"
    "Exit status: 0 stopped by SIGINT or SIGTERM; 1 failed; 2 usage error, or an error in the "
    "configuration.";

std::int32_t parseLocation(std::string_view text) {
  std::int32_t location = 0;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), location);
  if (error == std::errc() && stopped == text.data() + text.size()) return location;
  throw std::invalid_argument(fmt::format("\"{}\" is not a location: write an integer", text));
}

// "1", or "1=0" of a location that is called otherwise here.
Serve parseServe(const std::string& text) {
  const auto equals = text.find('=');
  const auto location = parseLocation(std::string_view(text).substr(0, equals));
  return {location, equals == std::string::npos
                        ? location
                        : parseLocation(std::string_view(text).substr(equals + 1))};
}

// "1,2=ioc1.lab:9900".
Remote parseRemote(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos)
    throw std::invalid_argument(fmt::format("\"{}\": write LOCATION[,LOCATION]=HOST:PORT", text));
  Remote remote;
  for (std::size_t begin = 0, end = 0; end < equals; begin = end + 1) {
    end = std::min(text.find(',', begin), equals);
    remote.locations.push_back(parseLocation(std::string_view(text).substr(begin, end - begin)));
  }
  remote.address = parseAddress(text.substr(equals + 1));
  return remote;
}

// Errors of a value are said as those of its option.
template <class Function>
void asOption(const std::string& option, Function function) try {
  function();
} catch (const std::invalid_argument& error) {
  throw CLI::ValidationError(option, error.what());
}

// What an option adds to the configuration, with its own place.
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

// Sets what an option that goes before a file says; see RouterArguments::overrides_.
void applyOverride(WrittenConfig& to, const std::string& name, const std::string& value) {
  auto& config = to.config;
  const std::map<std::string, std::string*> texts{
      {"name", &config.name},          {"backplane", &config.backplane},
      {"log-level", &config.logLevel}, {"tls-certificate", &config.tls.certificate},
      {"tls-key", &config.tls.key},    {"tls-authorities", &config.tls.authorities}};
  if (const auto text = texts.find(name); text != texts.end()) *text->second = value;
  else if (name == "mode") config.rights.mode = parseMode(value);
  else if (name == "group") config.rights.group = parseGroup(value);
  else setLimit(config.limits, name, value);
  const auto place = "--" + name;
  constexpr std::string_view kTls = "tls-";
  if (name.starts_with(kTls)) to.places.tls[name.substr(kTls.size())] = place;
  to.places.root[name] = to.places.limits[name] = place;
}

}  // namespace

std::optional<int> RouterArguments::start(int argc, const char* const* argv) {
  CLI::App app("mpf-router - joins this host's backplane with those of other hosts, over TCP",
               kProgram);
  const auto inPlaceOfFile = addFile(app);
  addOverrides(app);
  app.add_flag("--check", checkOnly_, "Only load the configuration, and say what it means");
  app.add_option("--ready-fd", readyDescriptor_,
                 "Write the listening addresses there, a line each, once it listens, and close it")
      ->type_name("FD");
  app.footer(kFooter);
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  try {
    for (const auto* const option : inPlaceOfFile) {
      if (!file_.empty() && option->count() != 0)
        throw ConfigError(fmt::format("{}: it stands in place of a file; write it into {}",
                                      option->get_name(), file_));
    }
    takeTransport();
    config_ = loadConfig();
  } catch (const ConfigError& error) {
    if (file_.empty()) return refuseArguments(kProgram, error.what());
    printError("{}: {}\n", kProgram, error.what());
    return 2;
  }
  if (!checkOnly_) return std::nullopt;
  fmt::print("{}", describe(config_));
  return 0;
}

std::vector<CLI::Option*> RouterArguments::addFile(CLI::App& app) {
  auto& [options, places] = options_;
  places.isFile = false;
  places.root = places.tls = places.limits = {{"", ""}};
  app.add_option("file", file_, "Configuration in TOML; without it, options say what to do")
      ->type_name("FILE");
  std::vector<CLI::Option*> instead{
      addEntries(
          app, "--serve", "LOCATION[=LOCAL]", options.serve, places.serve, parseServe,
          "Clients elsewhere reach servers of this host at LOCATION; here they are at LOCAL"),
      addEntries(
          app, "--listen", "HOST:PORT", options.listen, places.listen,
          [](const std::string& text) { return Listen{parseAddress(text)}; },
          "Where routers of clients connect: a name, 10.0.0.7:9900, [fd00::7]:9900, *:9900"),
      addEntries(app, "--remote", "LOCATION[,LOCATION]=HOST:PORT", options.remotes, places.remotes,
                 parseRemote,
                 "Clients of this host reach these locations through the router there"),
      app.add_flag("--plain", plain_, "TCP as it is, in place of TLS"),
      app.add_flag("--allow-public-plain", options.allowPublicPlain,
                   "That, too, at addresses that are neither private nor link-local"),
      app.add_option("--tls-name", tlsName_,
                     "Name in the certificate of the --remote, when it is not its host's")
          ->type_name("NAME")};
  for (auto* const option : instead) option->group("In place of a file");
  return instead;
}

// They are tried when they are parsed, so that an error names the option, and applied by each
// load().
void RouterArguments::addOverrides(CLI::App& app) {
  const auto add = [&](const std::string& name, const std::string& type, const std::string& text) {
    const auto take = [this, name](const std::string& value) {
      WrittenConfig scratch;
      asOption("--" + name, [&] { applyOverride(scratch, name, value); });
      overrides_[name] = value;
    };
    app.add_option_function<std::string>("--" + name, take, text)
        ->type_name(type)
        ->group("Whatever a file says");
  };
  add("tls-certificate", "FILE", "Our certificate, and the chain up to its authority: PEM");
  add("tls-key", "FILE", "Its key: PEM, without a password");
  add("tls-authorities", "FILE", "Certificates of those who sign our peers' certificates: PEM");
  add("name", "NAME", "What others call this router; default: the name of this host");
  add("backplane", "NAME", "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  add("mode", "MODE",
      "Who of this host may be a client of remote servers, octal as for chmod; default: 0600, the "
      "router's own user");
  add("group", "GROUP", "The group that --mode speaks of; default: the user's own");
  add("log-level", "LEVEL",
      "Least weight of what it says on stderr: trace, debug, info, warning, error, critical, off; "
      "default: info");
  for (const auto& name : limitNames())
    add(name, limitType(name),
        fmt::format("{}; default: {}", limitPurpose(name), limitText({}, name)));
}

void RouterArguments::takeTransport() {
  auto& config = options_.config;
  const auto security = plain_ ? Security::plain : Security::tls;
  for (auto& listen : config.listen) listen.security = security;
  for (auto& remote : config.remotes) {
    remote.security = security;
    remote.tlsName = tlsName_;
  }
  if (!tlsName_.empty() && config.remotes.size() != 1)
    throw ConfigError("--tls-name: it is that of one --remote; a file can name more");
}

RouterConfig RouterArguments::loadConfig() const {
  auto written = file_.empty() ? options_ : readConfig(file_);
  for (const auto& [name, value] : overrides_) applyOverride(written, name, value);
  completeConfig(written);
  return written.config;
}

}  // namespace mpf::router
