// SPDX-License-Identifier: MIT
// msr: message server report (manual, "Diagnostic Aids"), extended by latencies, fates and the
// clients of the server.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <optional>

#include "base/duration_text.h"
#include "base/print_error.h"
#include "base/printable.h"
#include "tools/commands.h"
#include "tools/report/report.h"
#include "tools/report/report_json.h"
#include "tools/report/sparkline.h"
#include "tools/text/table.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

struct MsrArguments : ReportArguments {
  std::string server;                    // empty: all
  std::optional<std::int32_t> location;  // nullopt: any
};

template <class Value>
void printField(const char* name, const Value& value) {
  constexpr std::size_t kIndent = 20;
  fmt::print("{}", wrap(fmt::format("{:>{}} ", name, kIndent - 1), fmt::to_string(value), kIndent));
}

void printLatencies(const char* name, const Latencies& latencies) {
  if (latencies.count == 0) return;
  const auto at = [&](double percent) {
    return durationText(static_cast<double>(latencies.percentileNs(percent)));
  };
  printField(name,
             fmt::format("p50 {}, p99 {}, p99.9 {}, max {}  ({} sampled)", at(50), at(99), at(99.9),
                         durationText(static_cast<double>(latencies.maxNs)), latencies.count));
  fmt::print("{:20}{}\n", "", sparkline(latencies, lineColumns() - 20));
}

std::string stateOf(const SnapshotDelta& delta, const LinkView& link, const WindowView* client) {
  auto state = client == nullptr ? "gone" : delta.stateOf(*client);
  if (link.isOpen()) return state;
  return state == "alive" ? "connecting" : state + ", connecting";
}

void printClients(const SnapshotDelta& delta, const WindowView& server) {
  Table table({"client", "state", ">inQueue", ">open", ">requests", ">replies", ">notTaken",
               ">refused", ">bytes"});
  for (const auto& link : server.links) {
    const auto* client = delta.find(link.clientWindow);
    table.add({client == nullptr ? "?" : fmt::format("{}[{}]", client->name, client->pid),
               stateOf(delta, link, client), fmt::to_string(link.requests.waiting()),
               fmt::to_string(link.unanswered), fmt::to_string(link.requests.sent),
               fmt::to_string(link.replies.sent), fmt::to_string(link.replies.waiting()),
               fmt::to_string(link.refused), fmt::to_string(link.bytes)});
  }
  if (!table.isEmpty()) fmt::print("{}", table.fitted("  "));
}

// For a server on another host: the router connection that leads to it.
void printVia(const SnapshotDelta& delta, const SnapshotDelta::RouterLineOf& at) {
  const auto& line = *at.line;
  const auto peer = line.peer.empty() ? std::string() : line.peer + " at ";
  const auto roundTrip =
      line.roundTripNs == 0 ? std::string()
                            : ", round trip " + durationText(static_cast<double>(line.roundTripNs));
  printField("via", fmt::format("{}{}, {}{}, router {}[{}]", peer, line.address,
                                delta.stateOf(*at.router, line), roundTrip, at.router->name,
                                at.router->owner.pid));
}

// The first five lines are those of the manual.
void print(const SnapshotDelta& delta, const WindowView& server) {
  const auto totals = Totals::of(server);
  fmt::print("{}", wrap("", server.name, 2));
  printField("queueSize", server.queueSize);
  printField("inQueue", totals.incoming.waiting());
  printField("queueRequests", server.received);
  printField("queueFullResponses", totals.refused);
  printField("replyRequests", server.sent);
  const auto work = delta.workOf(server);
  const auto state = work.empty() ? delta.stateOf(server) : "busy with " + work;
  printField("state",
             fmt::format("{}, pid {}, {}, backplane {}, location {}, up {}", state, server.pid,
                         server.program, delta.now().backplane, server.location,
                         durationText(static_cast<double>(server.ageNs))));
  if (const auto at = delta.routerOf(server)) printVia(delta, at);
  printField("fates", fmt::format("expired {}, refused {}", server.expired, server.refused));
  printField("replyQueueFull", server.replyQueueFull);
  printField("clientsDied", server.peersDied);
  printField("protocolErrors", server.protocolErrors);
  printField("alarms", server.alarms);
  printLatencies("queueWait", server.queueWait);
  printLatencies("service", server.service);
  printClients(delta, server);
}

// Prints that no server was found. The server may be in a segment that could not be read, so this
// prints those as well. Returns the exit status.
int explainNothing(const MsrArguments& arguments, const std::vector<std::string>& problems) {
  for (const auto& problem : problems) printError("mpf msr: {}\n", problem);
  const auto unless = problems.empty() ? "" : ", unless it is in a file that could not be read";
  if (!arguments.server.empty() || arguments.location) {
    const auto where =
        arguments.location ? fmt::format(" at location {}", *arguments.location) : "";
    const auto what =
        arguments.server.empty() ? "no server" : fmt::format("no server \"{}\"", arguments.server);
    printError("mpf msr: {}{}{}; `mpf ls` lists the servers\n", what, where, unless);
    return 1;
  }
  if (!arguments.json) fmt::print("no server{}\n", unless);
  return problems.empty() ? 0 : 1;
}

// Prints which segments could not be read: their servers are missing in the report.
void printProblems(const MsrArguments& arguments, const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  const auto count =
      counted(problems.size(), "file") + " could not be read: servers may be missing here";
  if (arguments.json) {
    printError("mpf msr: {}\n", count);
    for (const auto& problem : problems) printError("mpf msr: {}\n", problem);
    return;
  }
  fmt::print("{}", wrap("", count, 2));
  for (const auto& problem : problems) fmt::print("{}", wrap("problem: ", problem, 2));
}

int report(const MsrArguments& arguments) {
  bool found = false;
  std::vector<std::string> problems;
  const auto forEachServer = [&](const SnapshotDelta& delta, auto&& act) {
    problems.insert(problems.end(), delta.now().problems.begin(), delta.now().problems.end());
    for (const auto& server : delta.now().servers) {
      if (!arguments.server.empty() && server.name != printable(arguments.server)) continue;
      if (arguments.location && server.location != *arguments.location) continue;
      found = true;
      act(server);
    }
  };
  reportEach(
      arguments,
      [&](const SnapshotDelta& delta) {
        forEachServer(delta, [&](const WindowView& server) { print(delta, server); });
      },
      [&](const SnapshotDelta& delta, nlohmann::json& all) {
        forEachServer(delta, [&](const WindowView& server) {
          all.push_back(toJson(delta, server));
          all.back()["backplane"] = delta.now().backplane;
        });
      });
  if (!found) return explainNothing(arguments, problems);
  if (arguments.server.empty()) printProblems(arguments, problems);
  return 0;
}

}  // namespace

void addMsr(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "msr", "Message server report: queue, requests, fates, latencies and clients of a server");
  auto arguments = std::make_shared<MsrArguments>();
  command.add_option("server", arguments->server, "Name of the server; default: all");
  command.add_option("--location", arguments->location, "Location of the server; default: any");
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return report(*arguments); }; });
}

}  // namespace mpf::tools
