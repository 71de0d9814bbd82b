// SPDX-License-Identifier: MIT
#include <mpf/tools/top_rows.h>

#include <fmt/format.h>

#include <mpf/base/duration_text.h>
#include <mpf/tools/report.h>

namespace mpf::tools {
namespace {

constexpr std::size_t kNameColumns = 16;

// fmt cuts by characters; "~" says that something is missing.
TopCell nameCell(const std::string& name) {
  auto cut = fmt::format("{:.{}}", name, kNameColumns);
  if (cut.size() < name.size()) cut = fmt::format("{:.{}}~", name, kNameColumns - 1);
  return {cut, 0};
}

TopCell countCell(std::uint64_t count) { return {fmt::to_string(count), static_cast<double>(count)}; }

TopCell rateCell(double perSecond) { return {fmt::format("{:.0f}", perSecond), perSecond}; }

TopCell percentileCell(const Latencies& latencies, double percent) {
  if (latencies.count == 0) return {"-", 0};
  const auto ns = static_cast<double>(latencies.percentileNs(percent));
  return {durationText(ns), ns};
}

struct Sampled {
  Latencies queueWait, service;
};

Sampled sampledOf(const Look& look, const WindowView& window) {
  const auto* was = look.before(window);
  if (was == nullptr) return {window.queueWait, window.service};
  return {between(was->queueWait, window.queueWait), between(was->service, window.service)};
}

std::string stateOf(const Look& look, std::uint64_t incarnation) {
  const auto* window = look.find(incarnation);
  return window == nullptr ? "gone" : look.stateOf(*window);
}

bool isAlarming(const std::string& state) { return state != "alive" && state != "closed"; }

std::string linkState(const LinkView& link) {
  if (link.serverState == layout::LinkState::refused) return "refused";
  return link.isOpen() ? "open" : "connecting";
}

std::string nameOf(const Look& look, std::uint64_t incarnation) {
  const auto* window = look.find(incarnation);
  return window == nullptr ? "?" : fmt::format("{}[{}]", window->name, window->pid);
}

}  // namespace

TopTable topServers(const Look& look) {
  TopTable table{{"SERVER", "STATE", ">CONN", ">QUEUED", ">REQ/s", ">QUEUE99", ">SERVE50", ">SERVE99"}, {}};
  for (const auto& server : look.now().servers) {
    const auto state = look.stateOf(server);
    const auto sampled = sampledOf(look, server);
    table.rows.push_back({server.incarnation,
                          isAlarming(state),
                          {nameCell(serverText(server.name, server.location)),
                           {state, 0},
                           countCell(server.links.size()),
                           countCell(Totals::of(server).incoming.waiting()),
                           rateCell(look.ratesOf(server).receivedPerSecond),
                           percentileCell(sampled.queueWait, 99),
                           percentileCell(sampled.service, 50),
                           percentileCell(sampled.service, 99)}});
  }
  return table;
}

TopTable topClients(const Look& look) {
  TopTable table{{"CLIENT", "STATE", ">PID", ">CONN", ">OPEN REQ", ">REFUSED", ">REQ/s", ">REPLY50", ">REPLY99"}, {}};
  for (const auto& client : look.now().clients) {
    const auto state = look.stateOf(client);
    const auto totals = Totals::of(client);
    const auto sampled = sampledOf(look, client);
    table.rows.push_back({client.incarnation,
                          isAlarming(state),
                          {nameCell(client.name),
                           {state, 0},
                           countCell(static_cast<std::uint64_t>(std::max(client.pid, 0))),
                           countCell(client.links.size()),
                           countCell(totals.unanswered),
                           countCell(totals.refused),
                           rateCell(look.ratesOf(client).sentPerSecond),
                           percentileCell(sampled.service, 50),
                           percentileCell(sampled.service, 99)}});
  }
  return table;
}

TopTable topLinks(const Look& look, const WindowView& window) {
  TopTable table{
      {window.isServer ? "CLIENT" : "SERVER", "STATE", "LINK", ">QUEUED", ">OPEN REQ", ">REFUSED", ">REQ/s", ">REPLY/s", ">BYTES"}, {}};
  for (const auto& link : window.links) {
    const auto state = stateOf(look, window.isServer ? link.clientWindow : link.serverWindow);
    const auto rates = look.ratesOf(link);
    table.rows.push_back({link.incarnation,
                          isAlarming(state) || link.serverState == layout::LinkState::refused,
                          {nameCell(window.isServer ? nameOf(look, link.clientWindow) : serverText(link.server, link.location)),
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

TopTable topLink(const Look& look, const LinkView& link) {
  TopTable table{{"OF THE LINK", "NOW"}, {}};
  const auto add = [&](const char* name, std::string text) {
    table.rows.push_back({table.rows.size() + 1, false, {{name, 0}, {std::move(text), 0}}});
  };
  const auto rates = look.ratesOf(link);
  add("server", fmt::format("{}, {}", serverText(link.server, link.location), stateOf(look, link.serverWindow)));
  add("client", fmt::format("{}, {}", nameOf(look, link.clientWindow), stateOf(look, link.clientWindow)));
  add("link", linkState(link));
  add("queue", fmt::format("{} of {} wait", link.requests.waiting(), link.queueSize));
  add("requests", fmt::format("{} sent, {} taken, {:.0f}/s", link.requests.sent, link.requests.taken, rates.sentPerSecond));
  add("replies", fmt::format("{} sent, {} taken, {:.0f}/s", link.replies.sent, link.replies.taken, rates.receivedPerSecond));
  add("unanswered", fmt::to_string(link.unanswered));
  add("refused sends", fmt::to_string(link.refused));
  add("shared memory", fmt::format("{} bytes", link.bytes));
  add("incarnation", fmt::format("{:x}", link.incarnation));
  return table;
}

}  // namespace mpf::tools
