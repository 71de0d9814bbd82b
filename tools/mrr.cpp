// SPDX-License-Identifier: MIT
// mrr: message router report (manual, "Diagnostic Aids"). On one host each process that has clients is a client router, each server
// a server router; what they have in their queues, whom they reach, how much goes through.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <memory>

#include <mpf/tools/commands.h>
#include <mpf/tools/report.h>
#include <mpf/tools/report_json.h>

namespace mpf::tools {
namespace {

// The manual's word, and ours for what it could not tell.
std::string routerState(const std::string& state) {
  if (state == "alive") return "stateConnected";
  return state + (state == "dead" ? " (removed by the next program that attaches)" : "");
}

std::uint32_t largestQueue(const WindowView& window) {
  std::uint32_t size = window.isServer ? window.queueSize : 0;
  for (const auto& link : window.links) size = std::max(size, link.queueSize);
  return size;
}

void printRates(const Rates& rates) {
  fmt::print("   sendPerSec {:.0f} receivePerSec {:.0f}\n", rates.sentPerSecond, rates.receivedPerSecond);
}

void printClient(std::size_t number, const Look& look, const WindowView& client) {
  const auto totals = Totals::of(client);
  fmt::print("{:2} {}[{}] {} queueSize {} inQueue {} sendQueueFull {} unanswered {}\n", number, client.name, client.pid,
             routerState(look.stateOf(client)), largestQueue(client), totals.outgoing.waiting(), totals.refused, totals.unanswered);
  std::map<std::pair<std::string, std::string>, int> servers;  // name and state to the number of clients
  for (const auto& link : client.links) ++servers[{serverText(link.server, link.location), link.isOpen() ? "connected" : "connecting"}];
  for (const auto& wish : client.wishes) ++servers[{serverText(wish.server, wish.location), "waiting for the server"}];
  for (const auto& [server, clients] : servers) {
    fmt::print("   Server {} has {} client{}. bindState {}\n", server.first, clients, clients == 1 ? "" : "s", server.second);
  }
  printRates(look.ratesOf(client));
}

void printServer(std::size_t number, const Look& look, const WindowView& server) {
  fmt::print("{:2} {}[{}] {} queueSize {} inQueue {} replyQueueFull {} clients {}\n", number, serverText(server.name, server.location),
             server.pid, routerState(look.stateOf(server)), largestQueue(server), Totals::of(server).incoming.waiting(),
             server.replyQueueFull, server.links.size());
  printRates(look.ratesOf(server));
}

void printRouters(const Look& look) {
  std::size_t number = 0;
  fmt::print("backplane {}\nclientRouterList\n", look.now().backplane);
  for (const auto& client : look.now().clients) printClient(++number, look, client);
  fmt::print("serverRouterList\n");
  number = 0;
  for (const auto& server : look.now().servers) printServer(++number, look, server);
  for (const auto& problem : look.now().problems) fmt::print("problem: {}\n", problem);
}

int report(const ReportArguments& arguments) {
  const int backplanes = reportEach(arguments, printRouters, [](const Look& look, nlohmann::json& all) { all.push_back(toJson(look)); });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

}  // namespace

void addMrr(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("mrr", "Message router report: who talks to whom, how much waits, how much goes through");
  auto arguments = std::make_shared<ReportArguments>();
  arguments->intervalMs = 1000;
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return report(*arguments); }; });
}

}  // namespace mpf::tools
