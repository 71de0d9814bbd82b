// SPDX-License-Identifier: MIT
// mpf ls: backplanes, servers, clients, and how they are.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <map>
#include <memory>

#include <mpf/base/duration_text.h>
#include <mpf/shm/window.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/report.h>
#include <mpf/tools/report_json.h>
#include <mpf/tools/table.h>

namespace mpf::tools {
namespace {

std::string age(const WindowView& window) { return durationText(static_cast<double>(window.ageNs)); }

std::string servers(const Look& look) {
  Table table({"SERVER", ">LOCATION", "STATE", ">PID", "PROGRAM", ">CLIENTS", ">WAITING", ">REQUESTS", ">AGE"});
  for (const auto& server : look.now().servers) {
    const auto totals = Totals::of(server);
    table.add({server.name, fmt::to_string(server.location), look.stateOf(server), fmt::to_string(server.pid), server.program,
               fmt::to_string(server.links.size()), fmt::to_string(totals.incoming.waiting()), fmt::to_string(server.received),
               age(server)});
  }
  return table.isEmpty() ? "  no server\n" : table.text("  ");
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

std::string clients(const Look& look) {
  Table table({"CLIENT", "STATE", ">PID", "PROGRAM", ">UNANSWERED", ">AGE", "SERVERS"});
  for (const auto& client : look.now().clients) {
    table.add({client.name, look.stateOf(client), fmt::to_string(client.pid), client.program, fmt::to_string(Totals::of(client).unanswered),
               age(client), serversOf(client)});
  }
  return table.isEmpty() ? "  no client\n" : table.text("  ");
}

void printBackplane(const Look& look) {
  fmt::print("backplane {}\n{}{}", look.now().backplane, servers(look), clients(look));
  for (const auto& problem : look.now().problems) fmt::print("  problem: {}\n", problem);
}

int list(const ReportArguments& arguments) {
  const int backplanes = reportEach(arguments, printBackplane, [](const Look& look, nlohmann::json& all) { all.push_back(toJson(look)); });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

}  // namespace

void addLs(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("ls", "Backplanes, servers and clients, and how they are");
  auto arguments = std::make_shared<ReportArguments>();
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return list(*arguments); }; });
}

}  // namespace mpf::tools
