// SPDX-License-Identifier: MIT
// mrr: message router report (manual, "Diagnostic Aids"). On one host each process that has clients
// is listed as a client router, and each server as a server router, with their queues, their
// connections and their message rates. The connections of routers to other hosts follow them, as
// RMRClient and RMRServer.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <memory>

#include "base/duration_text.h"
#include "tools/commands.h"
#include "tools/report/report.h"
#include "tools/report/report_json.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

// "stateConnected", as in the manual, for a process that is alive. The manual has no names for the
// other states.
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
  fmt::print("   sendPerSec {:.0f} receivePerSec {:.0f}\n", rates.sentPerSecond,
             rates.receivedPerSecond);
}

// The first line of an entry, with its number.
void printHead(std::size_t number, const std::string& text) {
  fmt::print("{}", wrap(fmt::format("{:2} ", number), text, 5));
}

// Servers by name and state, with the number of their clients.
class Bindings {
 public:
  void add(const std::string& server, const char* state, std::size_t clients = 1) {
    servers_[{server, state}] += clients;
  }
  void add(const LinkView& link) {
    add(serverText(link.server, link.location), link.isOpen() ? "connected" : "connecting");
  }
  void add(const PendingBindView& pendingBind) {
    add(serverText(pendingBind.server, pendingBind.location), "waiting for the server");
  }
  void print() const {
    for (const auto& [server, clients] : servers_) {
      fmt::print("{}", wrap("   ",
                            fmt::format("Server {} has {}. bindState {}", server.first,
                                        counted(clients, "client"), server.second),
                            5));
    }
  }

 private:
  std::map<std::pair<std::string, std::string>, std::size_t> servers_;
};

void printClient(std::size_t number, const SnapshotDelta& delta, const WindowView& client) {
  const auto totals = Totals::of(client);
  printHead(number, fmt::format("{}[{}] {} queueSize {} inQueue {} sendQueueFull {} unanswered {}",
                                client.name, client.pid, routerState(delta.stateOf(client)),
                                largestQueue(client), totals.outgoing.waiting(), totals.refused,
                                totals.unanswered));
  Bindings servers;
  for (const auto& link : client.links) servers.add(link);
  for (const auto& pendingBind : client.pendingBinds) servers.add(pendingBind);
  servers.print();
  printRates(delta.ratesOf(client));
}

void printServer(std::size_t number, const SnapshotDelta& delta, const WindowView& server) {
  printHead(number, fmt::format("{}[{}] {} queueSize {} inQueue {} replyQueueFull {} clients {}",
                                serverText(server.name, server.location), server.pid,
                                routerState(delta.stateOf(server)), largestQueue(server),
                                Totals::of(server).incoming.waiting(), server.replyQueueFull,
                                server.links.size()));
  printRates(delta.ratesOf(server));
}

// ---- routers between hosts

using Router = SnapshotDelta::RouterLineOf;

// "stateConnected", "stateConnecting", "stateWaiting"; the state of the router if it is not alive.
std::string lineState(const SnapshotDelta& delta, const Router& at) {
  if (delta.stateOf(*at.router) != "alive") return delta.stateOf(*at.router);
  auto state = delta.stateOf(*at.router, *at.line);
  state.front() = static_cast<char>(state.front() - 'a' + 'A');
  return "state" + state;
}

// The servers of each connection. For a connection to a remote: servers on other hosts that local
// clients use or wait for. For a caller: local servers that its clients use.
class LineBindings {
 public:
  explicit LineBindings(const SnapshotDelta& delta) : delta_(delta) {
    for (const auto& server : delta.now().servers) addServer(server);
    for (const auto& client : delta.now().clients) {
      if (const auto at = delta.routerOf(client)) {
        for (const auto& link : client.links) of_[at.line].add(link);
      }
    }
    if (delta.now().routers.empty()) return;
    for (const auto& pendingBind : delta.now().pendingBinds) {
      for (const auto* line : linesTo(pendingBind.location)) of_[line].add(pendingBind);
    }
  }
  void print(const RouterLineView& line) const {
    if (const auto found = of_.find(&line); found != of_.end()) found->second.print();
  }

 private:
  void addServer(const WindowView& server) {
    const auto at = delta_.routerOf(server);
    if (!at) return;
    const auto name = serverText(server.name, server.location);
    const auto open =
        static_cast<std::size_t>(std::ranges::count_if(server.links, &LinkView::isOpen));
    if (open != 0 || server.links.empty()) of_[at.line].add(name, "connected", open);
    if (open != server.links.size())
      of_[at.line].add(name, "connecting", server.links.size() - open);
  }
  const std::vector<const RouterLineView*>& linesTo(std::int32_t location) {
    const auto [found, isNew] = linesTo_.try_emplace(location);
    if (!isNew) return found->second;
    for (const auto& router : delta_.now().routers) {
      if (const auto* line = router.lineTo(location)) found->second.push_back(line);
    }
    return found->second;
  }

  const SnapshotDelta& delta_;
  std::map<const RouterLineView*, Bindings> of_;
  std::map<std::int32_t, std::vector<const RouterLineView*>> linesTo_;
};

// The rates as one line, as in the manual, or as two lines when one would be too long.
void printLineRates(const LineRates& rates) {
  const auto messages = fmt::format("   sendPerSec {:.0f} receivePerSec {:.0f}",
                                    rates.messages.sentPerSecond, rates.messages.receivedPerSecond);
  const auto frames = fmt::format("tcpSendPerSec {:.0f} tcpReceivePerSec {:.0f}",
                                  rates.frames.sentPerSecond, rates.frames.receivedPerSecond);
  const bool isLong = messages.size() + 2 + frames.size() > lineColumns();
  fmt::print("{}{}{}\n", messages, isLong ? "\n   " : "  ", frames);
  fmt::print("   sendBytesPerSec {:.0f} receiveBytesPerSec {:.0f}\n", rates.bytes.sentPerSecond,
             rates.bytes.receivedPerSecond);
}

void printLine(std::size_t number, const SnapshotDelta& delta, const Router& at,
               const LineBindings& bindings) {
  const auto& line = *at.line;
  printHead(number,
            fmt::format("{} {} queueSize {} inQueue {} {} {}",
                        line.isClient() ? "RMRClient" : "RMRServer", lineState(delta, at),
                        line.queueSize, line.inQueue,
                        line.isClient() ? "sendQueueFull" : "replyQueueFull", line.queueFull));
  bindings.print(line);
  printLineRates(delta.ratesOf(*at.router, line));
  const auto roundTrip = line.roundTripNs == 0
                             ? std::string("unknown")
                             : durationText(static_cast<double>(line.roundTripNs));
  fmt::print("{}", wrap("   ",
                        fmt::format(
                            "roundTrip {} {} {}{} clients {}", roundTrip,
                            line.isConnected() ? "connectedFor" : "notConnectedFor",
                            durationText(static_cast<double>(
                                std::max<std::int64_t>(delta.now().atNs - line.sinceNs, 0))),
                            line.isClient() ? fmt::format(" reconnects {}", line.reconnects()) : "",
                            line.clients),
                        5));
  const auto peer = line.peer.empty() ? std::string("peer unknown")
                                      : fmt::format("peer {} ({})", line.peer, line.program);
  const auto locations = line.locations.empty() ? std::string() : " locations " + line.locations;
  fmt::print("{}", wrap("   ",
                        fmt::format("{} address {} {}{}", peer, line.address,
                                    line.isTls ? "tls" : "plain", locations),
                        5));
  fmt::print("{}",
             wrap("   ", fmt::format("router {}[{}]", at.router->name, at.router->owner.pid), 5));
  if (!line.problem.empty()) fmt::print("{}", wrap("   ", "problem " + line.problem, 5));
}

void printLines(std::size_t number, const SnapshotDelta& delta, bool areClients,
                const LineBindings& bindings) {
  for (const auto& router : delta.now().routers) {
    for (const auto& line : router.lines) {
      if (line.isClient() == areClients) printLine(++number, delta, {&router, &line}, bindings);
    }
  }
}

// Windows that a router has for programs on other hosts are not listed by themselves; they are part
// of the router's connection.
void printRouters(const SnapshotDelta& delta) {
  const LineBindings bindings(delta);
  std::size_t number = 0;
  fmt::print("backplane {}\nclientRouterList\n", delta.now().backplane);
  for (const auto& client : delta.now().clients) {
    if (!delta.routerOf(client)) printClient(++number, delta, client);
  }
  printLines(number, delta, true, bindings);
  fmt::print("serverRouterList\n");
  number = 0;
  for (const auto& server : delta.now().servers) {
    if (!delta.routerOf(server)) printServer(++number, delta, server);
  }
  printLines(number, delta, false, bindings);
  for (const auto& problem : delta.now().problems) fmt::print("{}", wrap("problem: ", problem, 2));
}

int report(const ReportArguments& arguments) {
  const int backplanes = reportEach(
      arguments, printRouters,
      [](const SnapshotDelta& delta, nlohmann::json& all) { all.push_back(toJson(delta)); });
  if (backplanes == 0 && !arguments.json) fmt::print("{}", kNoBackplane);
  return 0;
}

}  // namespace

void addMrr(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "mrr", "Message router report: connections, queues and message rates of clients and servers");
  auto arguments = std::make_shared<ReportArguments>();
  arguments->interval = std::chrono::seconds(1);
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return report(*arguments); }; });
}

}  // namespace mpf::tools
