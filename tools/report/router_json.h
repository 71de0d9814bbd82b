// SPDX-License-Identifier: MIT
// The JSON fields of a router's connection that reports and `mpf inspect` have in common.
// docs/tools.md describes each field.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/report/router_view.h"

namespace mpf::tools {

// Adds the fields to `entry`, an nlohmann::json or an nlohmann::ordered_json.
template <typename Json>
void addFacts(Json& entry, const RouterLineView& line, const std::string& state) {
  entry["role"] = line.isClient() ? "client" : "server";
  entry["state"] = state;
  entry["address"] = line.address;
  entry["tls"] = line.isTls;
  entry["peer"] = line.peer;
  entry["peer_program"] = line.program;
  entry["problem"] = line.problem;
  entry["connects"] = line.connects;
  entry["clients"] = line.clients;
  entry["bindings"] = line.bindings;
  entry["queue_size"] = line.queueSize;
  entry["in_queue"] = line.inQueue;
  entry["queue_full"] = line.queueFull;
  entry["round_trip_ns"] = line.roundTripNs;
  entry["messages_sent"] = line.messagesSent;
  entry["messages_received"] = line.messagesReceived;
  entry["frames_sent"] = line.framesSent;
  entry["frames_received"] = line.framesReceived;
  entry["bytes_sent"] = line.bytesSent;
  entry["bytes_received"] = line.bytesReceived;
}

}  // namespace mpf::tools
