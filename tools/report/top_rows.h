// SPDX-License-Identifier: MIT
// The tables of `mpf top`, made from a SnapshotDelta: servers, clients, the links of one of them,
// the details of one link, the connections of routers, the details of one connection.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

struct TopCell {
  std::string text;
  double number = 0;  // the value by which a column of numbers is sorted
};

struct TopRow {
  std::uint64_t id = 0;  // incarnation of the window or link; topId() of a router's connection
  // The row needs attention: stalled, stopped, dead, refused, not connected.
  bool isAlarm = false;
  std::vector<TopCell> cells;
};

struct TopTable {
  std::vector<std::string> headings;  // '>': numbers, as in Table
  std::vector<TopRow> rows;
};

// These fit into 80 columns unless names are long.
[[nodiscard]] TopTable topServers(const SnapshotDelta& delta);
[[nodiscard]] TopTable topClients(const SnapshotDelta& delta);
// The links of a server or a client.
[[nodiscard]] TopTable topLinks(const SnapshotDelta& delta, const WindowView& window);
// One row for each fact.
[[nodiscard]] TopTable topLink(const SnapshotDelta& delta, const LinkView& link);

// Connections to other hosts.
[[nodiscard]] TopTable topRouters(const SnapshotDelta& delta);
[[nodiscard]] TopTable topLine(const SnapshotDelta& delta, const RouterView& router,
                               const RouterLineView& line);
[[nodiscard]] std::uint64_t topId(const RouterView& router, const RouterLineView& line) noexcept;

// Keys and columns.
[[nodiscard]] TopTable topHelp();

// The title of an opened row: "server dac@2, alive", "client mpf[123], stopped",
// "dac <- mpf[123]", "router → ioc1, connected".
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const WindowView& window);
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const LinkView& link);
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const RouterView& router,
                                   const RouterLineView& line);

}  // namespace mpf::tools
