// SPDX-License-Identifier: MIT
#include <mpf/tools/report_json.h>

#include <algorithm>

#include <mpf/schema/message_types.h>
#include <mpf/tools/router_json.h>

namespace mpf::tools {
namespace {

using nlohmann::json;

json toJson(const Latencies& latencies) {
  return {{"count", latencies.count},
          {"p50_ns", latencies.percentileNs(50)},
          {"p99_ns", latencies.percentileNs(99)},
          {"p999_ns", latencies.percentileNs(99.9)},
          {"max_ns", latencies.maxNs}};
}

json toJson(const Traffic& traffic) { return {{"sent", traffic.sent}, {"taken", traffic.taken}, {"waiting", traffic.waiting()}}; }

json toJson(const LinkView& link, const WindowView* peer) {
  json entry{{"server", link.server},
             {"location", link.location},
             {"client_state", toString(link.clientState)},
             {"server_state", toString(link.serverState)},
             {"queue_size", link.queueSize},
             {"requests", toJson(link.requests)},
             {"replies", toJson(link.replies)},
             {"refused_sends", link.refused},
             {"unanswered", link.unanswered},
             {"bytes", link.bytes}};
  if (peer != nullptr) {
    entry["peer_pid"] = peer->pid;
    entry["peer_program"] = peer->program;
  }
  return entry;
}

json toJson(const Look& look, const RouterView& router, const RouterLineView& line) {
  const auto rates = look.ratesOf(router, line);
  json entry{{"since_s", static_cast<double>(std::max<std::int64_t>(look.now().atNs - line.sinceNs, 0)) / 1e9},
             {"locations", line.locationList()},
             {"sent_per_s", rates.messages.sentPerSecond},
             {"received_per_s", rates.messages.receivedPerSecond},
             {"frames_sent_per_s", rates.frames.sentPerSecond},
             {"frames_received_per_s", rates.frames.receivedPerSecond},
             {"bytes_sent_per_s", rates.bytes.sentPerSecond},
             {"bytes_received_per_s", rates.bytes.receivedPerSecond}};
  addFacts(entry, line, look.stateOf(router, line));
  return entry;
}

json toJson(const Look& look, const RouterView& router) {
  json lines = json::array();
  for (const auto& line : router.lines) lines.push_back(toJson(look, router, line));
  return {{"name", router.name},
          {"state", look.stateOf(router)},
          {"pid", router.owner.pid},
          {"program", router.program},
          {"age_s", static_cast<double>(router.ageNs) / 1e9},
          {"lines", lines}};
}

}  // namespace

json toJson(const Look& look, const WindowView& window) {
  const auto rates = look.ratesOf(window);
  json entry{{"name", window.name},
             {"state", look.stateOf(window)},
             {"pid", window.pid},
             {"program", window.program},
             {"age_s", static_cast<double>(window.ageNs) / 1e9},
             {"wait_mode", waitModeName(window.waitMode)},
             {"received", window.received},
             {"sent_per_s", rates.sentPerSecond},
             {"received_per_s", rates.receivedPerSecond},
             {"links_opened", window.linksOpened},
             {"links_closed", window.linksClosed},
             {"peers_died", window.peersDied},
             {"protocol_errors", window.protocolErrors},
             {"alarms", window.alarms},
             {"wakes", window.wakes},
             {"queue_wait", toJson(window.queueWait)},
             {"service", toJson(window.service)}};
  if (window.isServer) {
    entry.update({{"location", window.location},
                  {"queue_size", window.queueSize},
                  {"replies", window.sent},
                  {"expired", window.expired},
                  {"refused", window.refused},
                  {"reply_queue_full", window.replyQueueFull},
                  {"max_message_bytes", window.maxMessageBytes}});
  }
  if (look.isBusy(window)) {
    entry["handling"] = {{"type", toString(static_cast<MessageType>(window.handling->type))},
                         {"cmd", window.handling->cmd},
                         {"since_s", static_cast<double>(std::max<std::int64_t>(look.now().atNs - window.progressAtNs, 0)) / 1e9}};
  }
  if (const auto at = look.routerOf(window)) entry["via"] = {{"peer", at.line->peer}, {"address", at.line->address}};
  entry["links"] = json::array();
  for (const auto& link : window.links) {
    entry["links"].push_back(toJson(link, look.find(window.isServer ? link.clientWindow : link.serverWindow)));
  }
  return entry;
}

json toJson(const Look& look) {
  json servers = json::array();
  json clients = json::array();
  json routers = json::array();
  json waiting = json::array();
  for (const auto& router : look.now().routers) routers.push_back(toJson(look, router));
  for (const auto& server : look.now().servers) servers.push_back(toJson(look, server));
  for (const auto& client : look.now().clients) clients.push_back(toJson(look, client));
  for (const auto& wish : look.now().wishes) {
    const auto* client = look.find(wish.clientWindow);
    waiting.push_back({{"server", wish.server}, {"location", wish.location}, {"pid", client == nullptr ? 0 : client->pid}});
  }
  return {{"backplane", look.now().backplane}, {"servers", servers}, {"clients", clients}, {"routers", routers}, {"waiting", waiting},
          {"problems", look.now().problems}};
}

}  // namespace mpf::tools
