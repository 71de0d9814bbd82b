// SPDX-License-Identifier: MIT
#include "tools/inspect/waits.h"

#include <fmt/format.h>

#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

// The state of the process that messages wait for, and whether it has been notified of them.
std::string posture(const SnapshotDelta& delta, const WindowView& window, std::uint32_t index,
                    bool isPolled) {
  const auto state = delta.stateOf(window);
  // A process that polls, but takes nothing, may compute, or sleep anywhere but on its window.
  if (isPolled && state == "stalled" && window.sleeping == layout::SleepState::awake)
    return "(stalled, not asleep on its window)";
  const auto* told = isPolled                      ? "it polls"
                     : window.hints.isReady(index) ? "ready bit set"
                                                   : "no ready bit";
  return fmt::format("({}{}, {})", state == "alive" ? "" : state + ", ", toString(window.sleeping),
                     told);
}

// Why a link is over; empty when it is not.
std::string endOf(const SnapshotDelta& delta, const LinkView& link, const WindowView* server,
                  const WindowView* client) {
  if (client == nullptr) return "over: the client is gone";
  if (server == nullptr) return "over: the server is gone";
  if (delta.stateOf(*client) == "dead") return "over: the client is dead";
  if (delta.stateOf(*server) == "dead") return "over: the server is dead";
  if (link.clientState == layout::LinkState::closed) return "over: closed by the client";
  if (link.serverState == layout::LinkState::closed) return "over: closed by the server";
  if (link.serverState == layout::LinkState::refused) return "over: refused by the server";
  return {};
}

}  // namespace

std::string waitsOf(const SnapshotDelta& delta, const LinkView& link) {
  const auto* server = delta.find(link.serverWindow);
  const auto* client = delta.find(link.clientWindow);
  auto text = endOf(delta, link, server, client);
  if (!text.empty()) return text;
  if (link.serverState == layout::LinkState::none) {
    const auto* told =
        server->hints.hasKnocked(link.incarnation) ? "knock pending" : "no knock pending";
    return fmt::format("the client waits to be accepted ({}, {})", toString(server->sleeping),
                       told);
  }
  if (const auto waiting = link.requests.waiting(); waiting != 0) {
    text = counted(waiting, "request waits", "requests wait") + " for the server " +
           posture(delta, *server, link.serverIndex, link.isPolledByServer);
  }
  if (const auto waiting = link.replies.waiting(); waiting != 0) {
    text += (text.empty() ? "" : "; ") + counted(waiting, "reply waits", "replies wait") +
            " for the client " + posture(delta, *client, link.clientIndex, link.isPolledByClient);
  }
  if (!text.empty()) return text;
  return link.unanswered == 0
             ? kIdle
             : "the client waits for " + counted(link.unanswered, "reply", "replies");
}

}  // namespace mpf::tools
