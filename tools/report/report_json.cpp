// SPDX-License-Identifier: MIT
#include "tools/report/report_json.h"

#include <algorithm>

#include <mpf/message_layout.h>
#include <mpf/message_types.h>

#include "tools/report/router_json.h"

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

json toJson(const Traffic& traffic) {
  return {{"sent", traffic.sent}, {"taken", traffic.taken}, {"waiting", traffic.waiting()}};
}

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

json toJson(const SnapshotDelta& delta, const RouterView& router, const RouterLineView& line) {
  const auto rates = delta.ratesOf(router, line);
  json entry{
      {"since_s",
       static_cast<double>(std::max<std::int64_t>(delta.now().atNs - line.sinceNs, 0)) / 1e9},
      {"locations", line.locationList()},
      {"sent_per_s", rates.messages.sentPerSecond},
      {"received_per_s", rates.messages.receivedPerSecond},
      {"frames_sent_per_s", rates.frames.sentPerSecond},
      {"frames_received_per_s", rates.frames.receivedPerSecond},
      {"bytes_sent_per_s", rates.bytes.sentPerSecond},
      {"bytes_received_per_s", rates.bytes.receivedPerSecond}};
  addFacts(entry, line, delta.stateOf(router, line));
  return entry;
}

json toJson(const SnapshotDelta& delta, const RouterView& router) {
  json lines = json::array();
  for (const auto& line : router.lines) lines.push_back(toJson(delta, router, line));
  return {{"name", router.name},
          {"state", delta.stateOf(router)},
          {"pid", router.owner.pid},
          {"program", router.program},
          {"age_s", static_cast<double>(router.ageNs) / 1e9},
          {"lines", lines}};
}

}  // namespace

json toJson(const SnapshotDelta& delta, const WindowView& window) {
  const auto rates = delta.ratesOf(window);
  json entry{{"name", window.name},
             {"state", delta.stateOf(window)},
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
                  {"fan_out_bytes", window.fanOutBytes},
                  {"max_message_bytes", window.maxMessageBytes}});
  }
  if (delta.isBusy(window)) {
    entry["handling"] = {{"type", toString(static_cast<MessageType>(window.handling->type))},
                         {"cmd", window.handling->cmd},
                         {"since_s", static_cast<double>(std::max<std::int64_t>(
                                         delta.now().atNs - window.progressAtNs, 0)) /
                                         1e9}};
  }
  if (const auto at = delta.routerOf(window))
    entry["via"] = {{"peer", at.line->peer}, {"address", at.line->address}};
  entry["links"] = json::array();
  for (const auto& link : window.links) {
    entry["links"].push_back(
        toJson(link, delta.find(window.isServer ? link.clientWindow : link.serverWindow)));
  }
  return entry;
}

json toJson(const SnapshotDelta& delta) {
  json servers = json::array();
  json clients = json::array();
  json routers = json::array();
  json waiting = json::array();
  for (const auto& router : delta.now().routers) routers.push_back(toJson(delta, router));
  for (const auto& server : delta.now().servers) servers.push_back(toJson(delta, server));
  for (const auto& client : delta.now().clients) clients.push_back(toJson(delta, client));
  for (const auto& pendingBind : delta.now().pendingBinds) {
    const auto* client = delta.find(pendingBind.clientWindow);
    waiting.push_back({{"server", pendingBind.server},
                       {"location", pendingBind.location},
                       {"pid", client == nullptr ? 0 : client->pid}});
  }
  return {{"backplane", delta.now().backplane},
          {"servers", servers},
          {"clients", clients},
          {"routers", routers},
          {"waiting", waiting},
          {"problems", delta.now().problems}};
}

}  // namespace mpf::tools
