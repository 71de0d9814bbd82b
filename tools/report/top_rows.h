// SPDX-License-Identifier: MIT
// TopRows: the tables of `mpf top`, made from a look: servers, clients, the links of one of them,
// all about one link; connections of routers, all about one.
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
  double number = 0;  // what a column of numbers is sorted by
};

struct TopRow {
  std::uint64_t id = 0;  // incarnation of the window or link; topId() of a router's connection
  // somebody should look at it: stalled, stopped, dead, refused, not connected
  bool isAlarm = false;
  std::vector<TopCell> cells;
};

struct TopTable {
  std::vector<std::string> headings;  // '>': numbers, as in Table
  std::vector<TopRow> rows;
};

// Fit into 80 columns as long as names do.
[[nodiscard]] TopTable topServers(const SnapshotDelta& delta);
[[nodiscard]] TopTable topClients(const SnapshotDelta& delta);
// Of a server or a client.
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

// What was opened, in a few words: "server dac@2, alive", "client mpf[123], stopped", "dac <-
// mpf[123]", "router → ioc1, connected".
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const WindowView& window);
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const LinkView& link);
[[nodiscard]] std::string topTitle(const SnapshotDelta& delta, const RouterView& router,
                                   const RouterLineView& line);

}  // namespace mpf::tools
