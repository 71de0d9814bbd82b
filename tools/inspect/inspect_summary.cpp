// SPDX-License-Identifier: MIT
#include "tools/inspect/inspect_summary.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>

#include "tools/doctor/host.h"
#include "tools/inspect/waits.h"
#include "tools/report/report.h"
#include "tools/text/table.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr std::size_t kMostRows = 30;

// "server dac@2", "client mpf".
std::string titleOf(const WindowView& window) {
  return window.isServer ? "server " + serverText(window.name, window.location)
                         : "client " + window.name;
}

std::string processText(const WindowView* window) {
  return window == nullptr ? "gone" : fmt::format("{}[{}]", window->name, window->pid);
}

Tree windowRow(const SnapshotDelta& delta, const WindowView& window) {
  Tree knocks = Tree::array();
  for (const auto knock : window.hints.knocks) knocks.push_back(hex(knock));
  Tree pendingBinds = Tree::array();
  for (const auto& pendingBind : window.pendingBinds)
    pendingBinds.push_back({{"server", pendingBind.server}, {"location", pendingBind.location}});
  return {{"window", hex(window.incarnation)},
          {"kind", window.isServer ? "server" : "client"},
          {"name", window.name},
          {"location", window.location},
          {"file", window.file},
          {"pid", window.pid},
          {"program", window.program},
          {"state", delta.stateOf(window)},
          {"sleeping", toString(window.sleeping)},
          {"links", window.links.size()},
          {"waiting", Totals::of(window).incoming.waiting()},
          {"bell", window.hints.bell},
          {"ready", window.hints.ready},
          {"knocks", knocks},
          {"rescan", window.hints.isRescanDue},
          {"waits_for", pendingBinds}};
}

std::string windowTable(const SnapshotDelta& delta) {
  Table table({"WINDOW", "STATE", ">PID", "SLEEPS", ">LINKS", ">WAITING", ">READY", ">KNOCKS"});
  std::size_t left = 0;
  for (const auto* windows : {&delta.now().servers, &delta.now().clients}) {
    std::size_t shown = 0;
    for (const auto& window : *windows) {
      if (++shown > kMostRows) {
        ++left;
        continue;
      }
      const auto* sleeps = window.sleeping == layout::SleepState::onFutex ? "futex"
                           : window.sleeping == layout::SleepState::awake ? "no"
                                                                          : "pipe";
      table.add({titleOf(window), delta.stateOf(window), fmt::to_string(window.pid), sleeps,
                 fmt::to_string(window.links.size()),
                 fmt::to_string(Totals::of(window).incoming.waiting()),
                 fmt::to_string(window.hints.ready.size()),
                 fmt::to_string(window.hints.knocks.size())});
    }
  }
  auto text = table.isEmpty() ? "  no window\n" : table.fitted("  ");
  if (left != 0) text += fmt::format("  and {} more; --json shows all\n", counted(left, "window"));
  return text;
}

// The clients that wait for an absent server; one line for each client and server.
std::string pendingBindText(const SnapshotDelta& delta) {
  std::map<std::pair<std::string, std::string>, std::size_t> waiting;
  for (const auto& client : delta.now().clients) {
    for (const auto& pendingBind : client.pendingBinds)
      ++waiting[{processText(&client), serverText(pendingBind.server, pendingBind.location)}];
  }
  std::string text;
  std::size_t shown = 0;
  for (const auto& [who, times] : waiting) {
    if (++shown > kMostRows) break;
    text += wrap("  ",
                 fmt::format("{} waits for the server {}, which is absent{}", who.first, who.second,
                             times == 1 ? "" : fmt::format(", {} times", times)),
                 4);
  }
  if (waiting.size() > kMostRows)
    text += fmt::format("  and {} more that wait; --json shows all\n", waiting.size() - kMostRows);
  return text;
}

std::size_t cutLinesOf(const SnapshotDelta& delta, const RouterView& router) {
  return static_cast<std::size_t>(std::ranges::count_if(
      router.lines,
      [&](const RouterLineView& line) { return delta.stateOf(router, line) != "connected"; }));
}

Tree routerRow(const SnapshotDelta& delta, const RouterView& router) {
  return {{"router", hex(router.incarnation)},
          {"name", router.name},
          {"file", router.file},
          {"pid", router.owner.pid},
          {"program", router.program},
          {"state", delta.stateOf(router)},
          {"lines", router.lines.size()},
          {"cut", cutLinesOf(delta, router)}};
}

std::string routerText(const SnapshotDelta& delta) {
  std::string text;
  for (const auto& router : delta.now().routers) {
    text += wrap("  ",
                 fmt::format("router {}[{}], {}: {}, {} of them cut", router.name, router.owner.pid,
                             delta.stateOf(router), counted(router.lines.size(), "connection"),
                             cutLinesOf(delta, router)),
                 4);
  }
  return text;
}

}  // namespace

std::vector<const LinkView*> linksOf(const Snapshot& snapshot) {
  std::vector<const LinkView*> links;
  std::set<std::uint64_t> seen;
  for (const auto* windows : {&snapshot.servers, &snapshot.clients}) {
    for (const auto& window : *windows) {
      for (const auto& link : window.links) {
        if (seen.insert(link.incarnation).second) links.push_back(&link);
      }
    }
  }
  return links;
}

Tree linkRow(const SnapshotDelta& delta, const LinkView& link) {
  return {{"link", hex(link.incarnation)},
          {"file", link.file},
          {"server", link.server},
          {"location", link.location},
          {"client", processText(delta.find(link.clientWindow))},
          {"requests_waiting", link.requests.waiting()},
          {"replies_waiting", link.replies.waiting()},
          {"unanswered", link.unanswered},
          {"bytes", link.bytes},
          {"waits", waitsOf(delta, link)}};
}

std::string linkTable(const SnapshotDelta& delta, const std::vector<const LinkView*>& links,
                      std::size_t most) {
  std::string text;
  std::size_t shown = 0;
  for (const auto* link : links) {
    if (++shown > most) break;
    text += wrap(fmt::format("  {:<16}  ", hex(link->incarnation)),
                 fmt::format("{} <- {}", serverText(link->server, link->location),
                             processText(delta.find(link->clientWindow))),
                 20);
    text += wrap("    ", waitsOf(delta, *link), 6);
  }
  if (links.size() > most)
    text += fmt::format("  and {} more; --json shows all\n", counted(links.size() - most, "link"));
  return text;
}

Tree summaryTree(const SnapshotDelta& delta) {
  Tree windows = Tree::array();
  for (const auto* list : {&delta.now().servers, &delta.now().clients}) {
    for (const auto& window : *list) windows.push_back(windowRow(delta, window));
  }
  Tree links = Tree::array();
  for (const auto* link : linksOf(delta.now())) links.push_back(linkRow(delta, *link));
  Tree routers = Tree::array();
  for (const auto& router : delta.now().routers) routers.push_back(routerRow(delta, router));
  return {{"backplane", delta.now().backplane},
          {"files", delta.now().files},
          {"bytes", delta.now().bytes},
          {"windows", windows},
          {"routers", routers},
          {"links", links},
          {"problems", delta.now().problems}};
}

std::string summaryText(const SnapshotDelta& delta) {
  auto text = fmt::format("backplane {}: {}, {}\n{}", delta.now().backplane,
                          counted(delta.now().files, "file"), bytesText(delta.now().bytes),
                          windowTable(delta));
  text += routerText(delta) + pendingBindText(delta);
  auto links = linksOf(delta.now());
  const auto all = links.size();
  std::erase_if(links, [&](const LinkView* link) { return waitsOf(delta, *link) == kIdle; });
  text += linkTable(delta, links, kMostRows);
  if (all != 0) text += fmt::format("  {} of {} idle\n", all - links.size(), counted(all, "link"));
  for (const auto& problem : delta.now().problems) text += wrap("  problem: ", problem, 4);
  return text;
}

}  // namespace mpf::tools
