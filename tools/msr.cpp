// SPDX-License-Identifier: MIT
// msr: message server report (manual, "Diagnostic Aids"), extended by latencies, fates and the clients of the server.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>

#include <mpf/base/duration_text.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/report.h>
#include <mpf/tools/report_json.h>
#include <mpf/tools/sparkline.h>
#include <mpf/tools/table.h>

namespace mpf::tools {
namespace {

struct MsrArguments : ReportArguments {
  std::string server;  // empty: all
};

template <class Value>
void printField(const char* name, const Value& value) {
  fmt::print("{:>19} {}\n", name, value);
}

void printLatencies(const char* name, const Latencies& latencies) {
  if (latencies.count == 0) return;
  const auto at = [&](double percent) { return durationText(static_cast<double>(latencies.percentileNs(percent))); };
  printField(name, fmt::format("p50 {}, p99 {}, p99.9 {}, max {}  ({} sampled)", at(50), at(99), at(99.9),
                               durationText(static_cast<double>(latencies.maxNs)), latencies.count));
  printField("", sparkline(latencies));
}

void printClients(const Look& look, const WindowView& server) {
  Table table({"client", ">pid", "state", ">inQueue", ">unanswered", ">requests", ">replies", ">notTaken", ">refused", ">bytes"});
  for (const auto& link : server.links) {
    const auto* client = look.find(link.clientWindow);
    const auto state = client == nullptr ? "gone" : look.stateOf(*client);
    table.add({client == nullptr ? "?" : client->name, client == nullptr ? "" : fmt::to_string(client->pid),
               link.isOpen() ? state : state + ", connecting", fmt::to_string(link.requests.waiting()), fmt::to_string(link.unanswered),
               fmt::to_string(link.requests.sent), fmt::to_string(link.replies.sent), fmt::to_string(link.replies.waiting()),
               fmt::to_string(link.refused), fmt::to_string(link.bytes)});
  }
  if (!table.isEmpty()) fmt::print("{}", table.text("  "));
}

// The manual's five lines first, as they were.
void print(const Look& look, const WindowView& server) {
  const auto totals = Totals::of(server);
  fmt::print("{}\n", server.name);
  printField("queueSize", server.queueSize);
  printField("inQueue", totals.incoming.waiting());
  printField("queueRequests", server.received);
  printField("queueFullResponses", totals.refused);
  printField("replyRequests", server.sent);
  printField("state", fmt::format("{}, pid {}, {}, backplane {}, location {}, up {}", look.stateOf(server), server.pid, server.program,
                                  look.now().backplane, server.location, durationText(static_cast<double>(server.ageNs))));
  printField("fates", fmt::format("expired {}, refused {}", server.expired, server.refused));
  printField("replyQueueFull", server.replyQueueFull);
  printField("clientsDied", server.peersDied);
  printField("protocolErrors", server.protocolErrors);
  printLatencies("queueWait", server.queueWait);
  printLatencies("service", server.service);
  printClients(look, server);
}

int report(const MsrArguments& arguments) {
  bool found = false;
  const auto forEachServer = [&](const Look& look, auto&& act) {
    for (const auto& server : look.now().servers) {
      if (!arguments.server.empty() && server.name != arguments.server) continue;
      found = true;
      act(server);
    }
  };
  reportEach(
      arguments, [&](const Look& look) { forEachServer(look, [&](const WindowView& server) { print(look, server); }); },
      [&](const Look& look, nlohmann::json& all) {
        forEachServer(look, [&](const WindowView& server) {
          all.push_back(toJson(look, server));
          all.back()["backplane"] = look.now().backplane;
        });
      });
  if (found) return 0;
  if (arguments.server.empty()) {
    if (!arguments.json) fmt::print("no server\n");
    return 0;
  }
  fmt::print(stderr, "mpf msr: no server \"{}\"; `mpf ls` shows those that there are\n", arguments.server);
  return 1;
}

}  // namespace

void addMsr(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("msr", "Message server report: queue, requests, fates, latencies and clients of a server");
  auto arguments = std::make_shared<MsrArguments>();
  command.add_option("server", arguments->server, "Name of the server; default: all");
  addReport(command, *arguments);
  command.callback([arguments, &run] { run = [arguments] { return report(*arguments); }; });
}

}  // namespace mpf::tools
