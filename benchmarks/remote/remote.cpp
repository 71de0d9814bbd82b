// SPDX-License-Identifier: MIT
#include "benchmarks/remote/remote.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <iterator>

#include "benchmarks/local/report.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/remote/routers.h"

namespace mpf::bench {
namespace {

Place makePlace(const std::string& setting, const std::string& title, Surroundings (*make)(),
                const Placement& placement, const RemoteOptions& options) {
  Place place;
  place.setting = setting;
  place.title = title;
  place.wait = options.wait;
  place.clients = options.clients;
  place.runName = kRunPrefix + std::to_string(::getpid()) + "-" + setting;
  try {
    place.between = make();
  } catch (const std::exception& reason) {
    place.skipped = reason.what();
    return place;
  }
  if (!std::filesystem::exists(routerProgram()))
    place.skippedRouters = routerProgram() + " does not exist";
  place.routers =
      std::make_shared<RouterPair>(routerProgram(), place.runName, placement, place.between);
  return place;
}

std::vector<Measurement> rowsOf(const std::vector<Place>& places) {
  std::vector<Measurement> all;
  for (const auto& place : places) {
    for (auto rows : {messageRows(place, &place == &places.front()), arrayRows(place),
                      crowdRows(place), idleRows(place)})
      std::move(rows.begin(), rows.end(), std::back_inserter(all));
  }
  return all;
}

std::string placementText(const Placement& at, Mode wait) {
  return fmt::format(
      "CPU {}: server and its router. CPU {}: client and its router. MPF servers and clients wait "
      "in mode {}; sockets of raw TCP block.\n",
      toString(at.server), toString(at.requester), toString(wait));
}

}  // namespace

void addOptions(CLI::App& app, RemoteOptions& options) {
  addOptions(app, static_cast<Options&>(options));
  addWaitOption(app, options.wait);
  app.add_option(
         "--clients", options.clients,
         "Number of clients in the rows about many clients of one pair of routers; default 10000")
      ->check(CLI::Range(2, 16'000));
}

Measurement rowAt(const Place& place, const std::string& question, const std::string& name,
                  bool routed) {
  Measurement row;
  row.setting = place.setting;
  row.question = place.title + question;
  row.name = name;
  row.mode = place.wait;
  row.skipped = place.skipped;
  if (!routed) return row;
  if (row.skipped.empty()) row.skipped = place.skippedRouters;
  row.environment = [routers = place.routers] {
    return std::make_unique<Running<RouterPair>>(routers);
  };
  row.environmentName = "routers, " + place.setting;
  return row;
}

int runRemote(const RemoteOptions& options) {
  const auto placement = place(options, true);
  if (!placement) return 2;
  const std::vector places{
      makePlace("loopback", kLoopback, Surroundings::loopback, *placement, options),
      makePlace("namespaces", kNamespaces, Surroundings::namespaces, *placement, options)};
  const Pace pace{std::chrono::milliseconds(800), std::chrono::seconds(10),
                  [&](const Measurement& row) { return options.quick || row.isSlow ? 1 : 3; }};
  return run(rowsOf(places), placement, options, pace, [&](const auto& results) {
    return placementText(*placement, options.wait) + remoteTable(results) + remoteGoals(results);
  });
}

}  // namespace mpf::bench
