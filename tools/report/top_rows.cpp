// SPDX-License-Identifier: MIT
#include "tools/report/top_rows.h"

#include <algorithm>
#include <fmt/format.h>
#include <sstream>
#include <utility>

#include "base/duration_text.h"
#include "tools/report/report.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr std::size_t kNameColumns = 16;

TopCell nameCell(const std::string& name) { return {cut(name, kNameColumns), 0}; }

TopCell countCell(std::uint64_t count) {
  return {fmt::to_string(count), static_cast<double>(count)};
}

TopCell rateCell(double perSecond) { return {fmt::format("{:.0f}", perSecond), perSecond}; }

TopCell percentileCell(const Latencies& latencies, double percent) {
  if (latencies.count == 0) return {"-", 0};
  const auto ns = static_cast<double>(latencies.percentileNs(percent));
  return {durationText(ns), ns};
}

struct Sampled {
  Latencies queueWait, service;
};

Sampled sampledOf(const SnapshotDelta& delta, const WindowView& window) {
  const auto* was = delta.before(window);
  if (was == nullptr) return {window.queueWait, window.service};
  return {between(was->queueWait, window.queueWait), between(was->service, window.service)};
}

std::string stateOf(const SnapshotDelta& delta, std::uint64_t incarnation) {
  const auto* window = delta.find(incarnation);
  return window == nullptr ? "gone" : delta.stateOf(*window);
}

bool isAlarming(const std::string& state) {
  return state != "alive" && state != "busy" && state != "closed" && state != "connected";
}

std::string linkState(const LinkView& link) {
  if (link.serverState == layout::LinkState::refused) return "refused";
  return link.isOpen() ? "open" : "connecting";
}

// The peer of a router's connection and the direction of the call: "→ ioc1", "← ioc2".
std::string lineName(const RouterLineView& line) {
  return (line.isClient() ? "→ " : "← ") + line.peerText();
}

// The lines of a text that fit beside the column of names.
std::vector<std::string> partsOf(const std::string& text) {
  constexpr std::size_t kBeside = 20;
  std::vector<std::string> parts;
  std::istringstream lines(text.empty() ? text : wrap(std::string(kBeside, ' '), text, kBeside));
  for (std::string line; std::getline(lines, line);) parts.push_back(line.substr(kBeside));
  return parts;
}

std::string nameOf(const SnapshotDelta& delta, std::uint64_t incarnation) {
  const auto* window = delta.find(incarnation);
  return window == nullptr ? "?" : fmt::format("{}[{}]", window->name, window->pid);
}

}  // namespace

TopTable topServers(const SnapshotDelta& delta) {
  TopTable table{
      {"SERVER", "STATE", ">CONN", ">QUEUED", ">REQ/s", ">QUEUE99", ">SERVE50", ">SERVE99"}, {}};
  for (const auto& server : delta.now().servers) {
    const auto state = delta.stateOf(server);
    const auto sampled = sampledOf(delta, server);
    const bool holdsUp = state == "busy" && Totals::of(server).incoming.waiting() != 0;
    table.rows.push_back({server.incarnation,
                          holdsUp || isAlarming(state),
                          {nameCell(serverText(server.name, server.location)),
                           {state, 0},
                           countCell(server.links.size()),
                           countCell(Totals::of(server).incoming.waiting()),
                           rateCell(delta.ratesOf(server).receivedPerSecond),
                           percentileCell(sampled.queueWait, 99),
                           percentileCell(sampled.service, 50),
                           percentileCell(sampled.service, 99)}});
  }
  return table;
}

TopTable topClients(const SnapshotDelta& delta) {
  TopTable table{{"CLIENT", "STATE", ">PID", ">CONN", ">OPEN REQ", ">REFUSED", ">REQ/s", ">REPLY50",
                  ">REPLY99"},
                 {}};
  for (const auto& client : delta.now().clients) {
    const auto state = delta.stateOf(client);
    const auto totals = Totals::of(client);
    const auto sampled = sampledOf(delta, client);
    table.rows.push_back({client.incarnation,
                          isAlarming(state),
                          {nameCell(client.name),
                           {state, 0},
                           countCell(static_cast<std::uint64_t>(std::max(client.pid, 0))),
                           countCell(client.links.size()),
                           countCell(totals.unanswered),
                           countCell(totals.refused),
                           rateCell(delta.ratesOf(client).sentPerSecond),
                           percentileCell(sampled.service, 50),
                           percentileCell(sampled.service, 99)}});
  }
  return table;
}

TopTable topLinks(const SnapshotDelta& delta, const WindowView& window) {
  TopTable table{{window.isServer ? "CLIENT" : "SERVER", "STATE", "LINK", ">QUEUED", ">OPEN REQ",
                  ">REFUSED", ">REQ/s", ">REPLY/s", ">BYTES"},
                 {}};
  for (const auto& link : window.links) {
    const auto state = stateOf(delta, window.isServer ? link.clientWindow : link.serverWindow);
    const auto rates = delta.ratesOf(link);
    table.rows.push_back({link.incarnation,
                          isAlarming(state) || link.serverState == layout::LinkState::refused,
                          {nameCell(window.isServer ? nameOf(delta, link.clientWindow)
                                                    : serverText(link.server, link.location)),
                           {state, 0},
                           {linkState(link), 0},
                           countCell(link.requests.waiting()),
                           countCell(link.unanswered),
                           countCell(link.refused),
                           rateCell(rates.sentPerSecond),
                           rateCell(rates.receivedPerSecond),
                           countCell(link.bytes)}});
  }
  return table;
}

TopTable topLink(const SnapshotDelta& delta, const LinkView& link) {
  TopTable table{{"LINK", "VALUE"}, {}};
  const auto add = [&](const char* name, std::string text) {
    table.rows.push_back({table.rows.size() + 1, false, {{name, 0}, {std::move(text), 0}}});
  };
  const auto rates = delta.ratesOf(link);
  add("server", fmt::format("{}, {}", serverText(link.server, link.location),
                            stateOf(delta, link.serverWindow)));
  add("client",
      fmt::format("{}, {}", nameOf(delta, link.clientWindow), stateOf(delta, link.clientWindow)));
  add("link", linkState(link));
  add("queue", fmt::format("{} of {} wait", link.requests.waiting(), link.queueSize));
  add("requests", fmt::format("{} sent, {} taken, {:.0f}/s", link.requests.sent,
                              link.requests.taken, rates.sentPerSecond));
  add("replies", fmt::format("{} sent, {} taken, {:.0f}/s", link.replies.sent, link.replies.taken,
                             rates.receivedPerSecond));
  add("unanswered", fmt::to_string(link.unanswered));
  add("refused sends", fmt::to_string(link.refused));
  add("shared memory", fmt::format("{} bytes", link.bytes));
  add("incarnation", fmt::format("{:x}", link.incarnation));
  return table;
}

std::uint64_t topId(const RouterView& router, const RouterLineView& line) noexcept {
  return router.incarnation + line.row + 1;
}

TopTable topRouters(const SnapshotDelta& delta) {
  TopTable table{{"ROUTER", "STATE", ">CONN", ">QUEUED", ">SENT/s", ">RECV/s", ">WRITES/s", ">RTT"},
                 {}};
  for (const auto& router : delta.now().routers) {
    for (const auto& line : router.lines) {
      const auto state = delta.stateOf(router, line);
      const auto rates = delta.ratesOf(router, line);
      const auto roundTripNs = static_cast<double>(line.roundTripNs);
      table.rows.push_back(
          {topId(router, line),
           isAlarming(state),
           {nameCell(lineName(line)),
            {state, 0},
            countCell(line.clients),
            countCell(line.inQueue),
            rateCell(rates.messages.sentPerSecond),
            rateCell(rates.messages.receivedPerSecond),
            rateCell(rates.frames.sentPerSecond),
            {line.roundTripNs == 0 ? "-" : durationText(roundTripNs), roundTripNs}}});
    }
  }
  return table;
}

TopTable topLine(const SnapshotDelta& delta, const RouterView& router, const RouterLineView& line) {
  TopTable table{{"CONNECTION", "VALUE"}, {}};
  const auto add = [&](const char* name, std::string text) {
    table.rows.push_back({table.rows.size() + 1, false, {{name, 0}, {std::move(text), 0}}});
  };
  const auto both = [](std::uint64_t sent, std::uint64_t received, const Rates& rates) {
    return fmt::format("{} sent, {:.0f}/s; {} received, {:.0f}/s", sent, rates.sentPerSecond,
                       received, rates.receivedPerSecond);
  };
  const auto rates = delta.ratesOf(router, line);
  const auto sinceNs = std::max<std::int64_t>(delta.now().atNs - line.sinceNs, 0);
  add("state", fmt::format("{} for {}", delta.stateOf(router, line),
                           durationText(static_cast<double>(sinceNs))));
  for (const auto* name = "problem"; const auto& part : partsOf(line.problem))
    add(std::exchange(name, ""), part);
  add("peer", line.peer.empty() ? "unknown" : fmt::format("{}, {}", line.peer, line.program));
  add("address", fmt::format("{}, {}", line.address, line.isTls ? "TLS" : "plain TCP"));
  if (!line.locations.empty()) add("locations", line.locations);
  add("connected", fmt::format("{} times", line.connects));
  add("round trip",
      line.roundTripNs == 0 ? "unknown" : durationText(static_cast<double>(line.roundTripNs)));
  add("clients", fmt::format("{}, of {}", line.clients, counted(line.bindings, "server")));
  add("queue",
      fmt::format("{} of {} wait; full {} times", line.inQueue, line.queueSize, line.queueFull));
  add("messages", both(line.messagesSent, line.messagesReceived, rates.messages));
  add("frames", both(line.framesSent, line.framesReceived, rates.frames));
  add("bytes", both(line.bytesSent, line.bytesReceived, rates.bytes));
  add("router", fmt::format("{}[{}], {}", router.name, router.owner.pid, delta.stateOf(router)));
  return table;
}

std::string topTitle(const SnapshotDelta& delta, const WindowView& window) {
  const auto name = window.isServer ? serverText(window.name, window.location)
                                    : fmt::format("{}[{}]", window.name, window.pid);
  return fmt::format("{} {}, {}", window.isServer ? "server" : "client", name,
                     delta.stateOf(window));
}

std::string topTitle(const SnapshotDelta& delta, const LinkView& link) {
  return fmt::format("{} <- {}", serverText(link.server, link.location),
                     nameOf(delta, link.clientWindow));
}

std::string topTitle(const SnapshotDelta& delta, const RouterView& router,
                     const RouterLineView& line) {
  return fmt::format("router {}, {}", lineName(line), delta.stateOf(router, line));
}

TopTable topHelp() {
  TopTable table{{"KEY", "DOES"}, {}};
  const auto add = [&](const char* key, const char* does) {
    table.rows.push_back({table.rows.size() + 1, false, {{key, 0}, {does, 0}}});
  };
  add("Tab", "servers, clients, connections to other hosts, in turn");
  add("arrows j k", "select a row; PgUp and PgDn by ten");
  add("Enter", "opens it: links of a server or client; details of a link");
  add("Esc", "back");
  add("s", "sorts by the next column, which has a *");
  add("r", "reverses; numbers begin with the largest");
  add("/", "filter: rows that contain a text; Enter keeps it, Esc removes it");
  add("q", "quits");
  add("red", "stalled, busy (requests wait), stopped, dead, refused, not connected");
  add("CONN", "connections; of a router, clients");
  add("QUEUED", "requests that wait; of a router, messages");
  add("OPEN REQ", "requests without reply or fate");
  add("REFUSED", "sends that were refused");
  add("QUEUE99", "time from send to receipt by the server: 99th percentile");
  add("SERVE50 99", "time from receipt to first reply: median, 99th percentile");
  add("REPLY50 99", "time from send to reply, measured by the client");
  add("WRITES/s", "frames sent; many messages may share one");
  add("RTT", "round trip to the other router");
  return table;
}

}  // namespace mpf::tools
