// SPDX-License-Identifier: MIT
// mpf ls: lists backplanes, servers, clients and connections to other hosts, with their states.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <memory>

#include "base/duration_text.h"
#include "shm/window.h"
#include "tools/commands.h"
#include "tools/report/report.h"
#include "tools/report/report_json.h"
#include "tools/text/table.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

std::string age(const WindowView& window) {
  return durationText(static_cast<double>(window.ageNs));
}

// The program of a server; for a server on another host, the router that leads to it: "→ ioc1".
std::string programOf(const SnapshotDelta& delta, const WindowView& server) {
  const auto at = delta.routerOf(server);
  return at ? "→ " + at.line->peerText() : server.program;
}

std::string servers(const SnapshotDelta& delta) {
  Table table({"SERVER", "STATE", ">PID", "~PROGRAM", ">CONN", ">QUEUED", ">TAKEN", ">AGE"});
  for (const auto& server : delta.now().servers) {
    const auto totals = Totals::of(server);
    table.add({serverText(server.name, server.location), delta.stateOf(server),
               fmt::to_string(server.pid), programOf(delta, server),
               fmt::to_string(server.links.size()), fmt::to_string(totals.incoming.waiting()),
               fmt::to_string(server.received), age(server)});
  }
  if (table.isEmpty()) return "  no server\n";
  auto text = table.fitted("  ");
  for (const auto& server : delta.now().servers) {
    const auto work = delta.workOf(server);
    if (!work.empty())
      text += wrap("  busy: ",
                   fmt::format("{}, with {}", serverText(server.name, server.location), work), 4);
  }
  return text;
}

// "dac x 3, gpib@2 (waiting), serial (connecting)": each server once, with the number of clients
// that the process has for it. Shows at most kMost names; `mpf mrr` shows all.
std::string serversOf(const WindowView& client) {
  constexpr std::size_t kMost = 6;
  std::map<std::string, int> names;
  for (const auto& link : client.links)
    ++names[serverText(link.server, link.location) + (link.isOpen() ? "" : " (connecting)")];
  for (const auto& pendingBind : client.pendingBinds)
    ++names[serverText(pendingBind.server, pendingBind.location) + " (waiting)"];
  std::string text;
  std::size_t shown = 0;
  for (const auto& [name, times] : names) {
    if (++shown > kMost) return text + fmt::format(", {} more", names.size() - kMost);
    text += (text.empty() ? "" : ", ") + name + (times == 1 ? "" : fmt::format(" x {}", times));
  }
  return text;
}

// The label of a client, with its program if that differs. The label of a client that a router has
// for another host names that host, and its program is left out.
std::string nameOf(const WindowView& client) {
  return client.name == client.program || client.router != 0
             ? client.name
             : fmt::format("{} ({})", client.name, client.program);
}

std::string clients(const SnapshotDelta& delta) {
  Table table({"CLIENT", "STATE", ">PID", ">UNANSWERED", ">AGE", "SERVERS"});
  for (const auto& client : delta.now().clients) {
    table.add({nameOf(client), delta.stateOf(client), fmt::to_string(client.pid),
               fmt::to_string(Totals::of(client).unanswered), age(client), serversOf(client)});
  }
  return table.isEmpty() ? "  no client\n" : table.fitted("  ");
}

// The connections to other hosts, in brief; `mpf mrr` shows all details.
std::string routers(const SnapshotDelta& delta) {
  Table table({"ROUTER", "STATE", ">CLIENTS", ">RTT", ">SINCE", "PEER"});
  for (const auto& router : delta.now().routers) {
    for (const auto& line : router.lines) {
      const auto since = durationText(
          static_cast<double>(std::max<std::int64_t>(delta.now().atNs - line.sinceNs, 0)));
      auto peer = line.peer + (line.locations.empty()
                                   ? ""
                                   : fmt::format("{}locations {}", line.peer.empty() ? "" : ", ",
                                                 line.locations));
      if (!line.isConnected() && !line.problem.empty())
        peer += (peer.empty() ? "" : ": ") + line.problem;
      table.add({(line.isClient() ? "→ " : "← ") + line.address, delta.stateOf(router, line),
                 fmt::to_string(line.clients),
                 line.roundTripNs == 0 ? "-" : durationText(static_cast<double>(line.roundTripNs)),
                 since, peer});
    }
  }
  return table.isEmpty() ? "" : table.fitted("  ");
}

void printBackplane(const SnapshotDelta& delta) {
  fmt::print("backplane {}\n{}{}{}", delta.now().backplane, servers(delta), clients(delta),
             routers(delta));
  for (const auto& problem : delta.now().problems)
    fmt::print("{}", wrap("  problem: ", problem, 4));
}

int list(const ReportArguments& arguments) {
  const int backplanes = reportEach(
      arguments, printBackplane,
      [](const SnapshotDelta& delta, nlohmann::json& all) { all.push_back(toJson(delta)); });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

}  // namespace

void addLs(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "ls", "Lists backplanes, servers, clients and connections to other hosts, with their states");
  auto arguments = std::make_shared<ReportArguments>();
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return list(*arguments); }; });
}

}  // namespace mpf::tools
