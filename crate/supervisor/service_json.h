// SPDX-License-Identifier: MIT
// A Service as the reply to "ps" shows it.
#pragma once

#include <nlohmann/json.hpp>

#include <mpf/clock.h>
#include <mpf/message_layout.h>

#include "crate/supervisor/service.h"

namespace mpf::crate {

[[nodiscard]] inline nlohmann::json toJson(const Service& service) {
  const auto upNs = service.isRunning() ? Clock::nowNs() - service.startedNs() : 0;
  nlohmann::json json{
      {"name", service.plan().name},        {"state", toString(service.state())},
      {"is_stalled", service.isStalled()},  {"pid", service.pid()},
      {"restarts", service.restarts()},     {"up_s", static_cast<double>(upNs) / 1e9},
      {"reason", service.reason()},         {"needs", service.plan().needs},
      {"servers", service.plan().servers},  {"command", service.plan().command},
      {"notifies", service.plan().notifies}};
  if (const auto& work = service.work()) {
    json["handling"] = {{"server", work->server},
                        {"type", toString(static_cast<MessageType>(work->handling.type))},
                        {"cmd", work->handling.cmd},
                        {"for_s", static_cast<double>(work->forNs) / 1e9}};
  }
  return json;
}

}  // namespace mpf::crate
