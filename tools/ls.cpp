// SPDX-License-Identifier: MIT
// mpf ls: backplanes, servers, clients, and how they are.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <memory>

#include <mpf/base/duration_text.h>
#include <mpf/shm/window.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/report.h>
#include <mpf/tools/report_json.h>
#include <mpf/tools/table.h>
#include <mpf/tools/wrap.h>

namespace mpf::tools {
namespace {

std::string age(const WindowView& window) { return durationText(static_cast<double>(window.ageNs)); }

// Of a server elsewhere, whom it is reached by: "→ ioc1".
std::string programOf(const Look& look, const WindowView& server) {
  const auto at = look.routerOf(server);
  return at ? "→ " + at.line->peerText() : server.program;
}

std::string servers(const Look& look) {
  Table table({"SERVER", "STATE", ">PID", "~PROGRAM", ">CONN", ">QUEUED", ">TAKEN", ">AGE"});
  for (const auto& server : look.now().servers) {
    const auto totals = Totals::of(server);
    table.add({serverText(server.name, server.location), look.stateOf(server), fmt::to_string(server.pid), programOf(look, server),
               fmt::to_string(server.links.size()), fmt::to_string(totals.incoming.waiting()), fmt::to_string(server.received),
               age(server)});
  }
  if (table.isEmpty()) return "  no server\n";
  auto text = table.fitted("  ");
  for (const auto& server : look.now().servers) {
    const auto work = look.workOf(server);
    if (!work.empty()) text += wrap("  busy: ", fmt::format("{}, with {}", serverText(server.name, server.location), work), 4);
  }
  return text;
}

// "dac x 3, gpib@2 (waiting), serial (connecting)": each once, however many clients the process has of it; `mpf mrr` has them all.
std::string serversOf(const WindowView& client) {
  constexpr std::size_t kMost = 6;
  std::map<std::string, int> names;
  for (const auto& link : client.links) ++names[serverText(link.server, link.location) + (link.isOpen() ? "" : " (connecting)")];
  for (const auto& wish : client.wishes) ++names[serverText(wish.server, wish.location) + " (waiting)"];
  std::string text;
  std::size_t shown = 0;
  for (const auto& [name, times] : names) {
    if (++shown > kMost) return text + fmt::format(", {} more", names.size() - kMost);
    text += (text.empty() ? "" : ", ") + name + (times == 1 ? "" : fmt::format(" x {}", times));
  }
  return text;
}

// A client's label, and its program if that is another word. A router's has the name of whom it is for.
std::string nameOf(const WindowView& client) {
  return client.name == client.program || client.router != 0 ? client.name : fmt::format("{} ({})", client.name, client.program);
}

std::string clients(const Look& look) {
  Table table({"CLIENT", "STATE", ">PID", ">UNANSWERED", ">AGE", "SERVERS"});
  for (const auto& client : look.now().clients) {
    table.add({nameOf(client), look.stateOf(client), fmt::to_string(client.pid), fmt::to_string(Totals::of(client).unanswered), age(client),
               serversOf(client)});
  }
  return table.isEmpty() ? "  no client\n" : table.fitted("  ");
}

// Connections to other hosts, in brief; `mpf mrr` has all of it.
std::string routers(const Look& look) {
  Table table({"ROUTER", "STATE", ">CLIENTS", ">RTT", ">SINCE", "PEER"});
  for (const auto& router : look.now().routers) {
    for (const auto& line : router.lines) {
      const auto since = durationText(static_cast<double>(std::max<std::int64_t>(look.now().atNs - line.sinceNs, 0)));
      auto peer = line.peer + (line.locations.empty() ? "" : fmt::format("{}locations {}", line.peer.empty() ? "" : ", ", line.locations));
      if (!line.isConnected() && !line.problem.empty()) peer += (peer.empty() ? "" : ": ") + line.problem;
      table.add({(line.isClient() ? "→ " : "← ") + line.address, look.stateOf(router, line), fmt::to_string(line.clients),
                 line.roundTripNs == 0 ? "-" : durationText(static_cast<double>(line.roundTripNs)), since, peer});
    }
  }
  return table.isEmpty() ? "" : table.fitted("  ");
}

void printBackplane(const Look& look) {
  fmt::print("backplane {}\n{}{}{}", look.now().backplane, servers(look), clients(look), routers(look));
  for (const auto& problem : look.now().problems) fmt::print("{}", wrap("  problem: ", problem, 4));
}

int list(const ReportArguments& arguments) {
  const int backplanes = reportEach(arguments, printBackplane, [](const Look& look, nlohmann::json& all) { all.push_back(toJson(look)); });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

}  // namespace

void addLs(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("ls", "Backplanes, servers, clients and connections to other hosts, and how they are");
  auto arguments = std::make_shared<ReportArguments>();
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return list(*arguments); }; });
}

}  // namespace mpf::tools
