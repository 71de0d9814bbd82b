// SPDX-License-Identifier: MIT
#include <mpf/tools/inspect_summary.h>

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>

#include <mpf/tools/host.h>
#include <mpf/tools/report.h>
#include <mpf/tools/table.h>
#include <mpf/tools/waits.h>
#include <mpf/tools/wrap.h>

namespace mpf::tools {
namespace {

constexpr std::size_t kMostRows = 30;

// "server dac@2", "client mpf".
std::string titleOf(const WindowView& window) {
  return window.isServer ? "server " + serverText(window.name, window.location) : "client " + window.name;
}

std::string processText(const WindowView* window) { return window == nullptr ? "gone" : fmt::format("{}[{}]", window->name, window->pid); }

Tree windowRow(const Look& look, const WindowView& window) {
  Tree knocks = Tree::array();
  for (const auto knock : window.hints.knocks) knocks.push_back(hex(knock));
  Tree wishes = Tree::array();
  for (const auto& wish : window.wishes) wishes.push_back({{"server", wish.server}, {"location", wish.location}});
  return {{"window", hex(window.incarnation)},
          {"kind", window.isServer ? "server" : "client"},
          {"name", window.name},
          {"location", window.location},
          {"file", window.file},
          {"pid", window.pid},
          {"program", window.program},
          {"state", look.stateOf(window)},
          {"sleeping", toString(window.sleeping)},
          {"links", window.links.size()},
          {"waiting", Totals::of(window).incoming.waiting()},
          {"bell", window.hints.bell},
          {"ready", window.hints.ready},
          {"knocks", knocks},
          {"rescan", window.hints.isRescanDue},
          {"waits_for", wishes}};
}

std::string windowTable(const Look& look) {
  Table table({"WINDOW", "STATE", ">PID", "SLEEPS", ">LINKS", ">WAITING", ">READY", ">KNOCKS"});
  std::size_t left = 0;
  for (const auto* windows : {&look.now().servers, &look.now().clients}) {
    std::size_t shown = 0;
    for (const auto& window : *windows) {
      if (++shown > kMostRows) {
        ++left;
        continue;
      }
      const auto* sleeps = window.sleeping == layout::SleepState::onFutex ? "futex"
                           : window.sleeping == layout::SleepState::awake ? "no"
                                                                          : "pipe";
      table.add({titleOf(window), look.stateOf(window), fmt::to_string(window.pid), sleeps, fmt::to_string(window.links.size()),
                 fmt::to_string(Totals::of(window).incoming.waiting()), fmt::to_string(window.hints.ready.size()),
                 fmt::to_string(window.hints.knocks.size())});
    }
  }
  auto text = table.isEmpty() ? "  no window\n" : table.fitted("  ");
  if (left != 0) text += fmt::format("  and {} more; --json has all\n", counted(left, "window"));
  return text;
}

// Who waits for a server that is not there, each server once a client.
std::string wishText(const Look& look) {
  std::map<std::pair<std::string, std::string>, std::size_t> waiting;
  for (const auto& client : look.now().clients) {
    for (const auto& wish : client.wishes) ++waiting[{processText(&client), serverText(wish.server, wish.location)}];
  }
  std::string text;
  std::size_t shown = 0;
  for (const auto& [who, times] : waiting) {
    if (++shown > kMostRows) break;
    text += wrap("  ",
                 fmt::format("{} waits for the server {}, which is not there{}", who.first, who.second,
                             times == 1 ? "" : fmt::format(", {} times", times)),
                 4);
  }
  if (waiting.size() > kMostRows) text += fmt::format("  and {} more that wait; --json has all\n", waiting.size() - kMostRows);
  return text;
}

std::size_t cutLinesOf(const Look& look, const RouterView& router) {
  return static_cast<std::size_t>(
      std::ranges::count_if(router.lines, [&](const RouterLineView& line) { return look.stateOf(router, line) != "connected"; }));
}

Tree routerRow(const Look& look, const RouterView& router) {
  return {{"router", hex(router.incarnation)},
          {"name", router.name},
          {"file", router.file},
          {"pid", router.owner.pid},
          {"program", router.program},
          {"state", look.stateOf(router)},
          {"lines", router.lines.size()},
          {"cut", cutLinesOf(look, router)}};
}

std::string routerText(const Look& look) {
  std::string text;
  for (const auto& router : look.now().routers) {
    text += wrap("  ",
                 fmt::format("router {}[{}], {}: {}, {} of them cut", router.name, router.owner.pid, look.stateOf(router),
                             counted(router.lines.size(), "connection"), cutLinesOf(look, router)),
                 4);
  }
  return text;
}

}  // namespace

std::vector<const LinkView*> linksOf(const Survey& survey) {
  std::vector<const LinkView*> links;
  std::set<std::uint64_t> seen;
  for (const auto* windows : {&survey.servers, &survey.clients}) {
    for (const auto& window : *windows) {
      for (const auto& link : window.links) {
        if (seen.insert(link.incarnation).second) links.push_back(&link);
      }
    }
  }
  return links;
}

Tree linkRow(const Look& look, const LinkView& link) {
  return {{"link", hex(link.incarnation)},
          {"file", link.file},
          {"server", link.server},
          {"location", link.location},
          {"client", processText(look.find(link.clientWindow))},
          {"requests_waiting", link.requests.waiting()},
          {"replies_waiting", link.replies.waiting()},
          {"unanswered", link.unanswered},
          {"bytes", link.bytes},
          {"waits", waitsOf(look, link)}};
}

std::string linkTable(const Look& look, const std::vector<const LinkView*>& links, std::size_t most) {
  std::string text;
  std::size_t shown = 0;
  for (const auto* link : links) {
    if (++shown > most) break;
    text += wrap(fmt::format("  {:<16}  ", hex(link->incarnation)),
                 fmt::format("{} <- {}", serverText(link->server, link->location), processText(look.find(link->clientWindow))), 20);
    text += wrap("    ", waitsOf(look, *link), 6);
  }
  if (links.size() > most) text += fmt::format("  and {} more; --json has all\n", counted(links.size() - most, "link"));
  return text;
}

Tree summaryTree(const Look& look) {
  Tree windows = Tree::array();
  for (const auto* list : {&look.now().servers, &look.now().clients}) {
    for (const auto& window : *list) windows.push_back(windowRow(look, window));
  }
  Tree links = Tree::array();
  for (const auto* link : linksOf(look.now())) links.push_back(linkRow(look, *link));
  Tree routers = Tree::array();
  for (const auto& router : look.now().routers) routers.push_back(routerRow(look, router));
  return {{"backplane", look.now().backplane},
          {"files", look.now().files},
          {"bytes", look.now().bytes},
          {"windows", windows},
          {"routers", routers},
          {"links", links},
          {"problems", look.now().problems}};
}

std::string summaryText(const Look& look) {
  auto text = fmt::format("backplane {}: {}, {}\n{}", look.now().backplane, counted(look.now().files, "file"), bytesText(look.now().bytes),
                          windowTable(look));
  text += routerText(look) + wishText(look);
  auto links = linksOf(look.now());
  const auto all = links.size();
  std::erase_if(links, [&](const LinkView* link) { return waitsOf(look, *link) == kIdle; });
  text += linkTable(look, links, kMostRows);
  if (all != 0) text += fmt::format("  {} of {} idle\n", all - links.size(), counted(all, "link"));
  for (const auto& problem : look.now().problems) text += wrap("  problem: ", problem, 4);
  return text;
}

}  // namespace mpf::tools
