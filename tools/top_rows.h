// SPDX-License-Identifier: MIT
// TopRows: the tables of `mpf top`, made from a look: servers, clients, the links of one of them, all about one link.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <mpf/tools/look.h>

namespace mpf::tools {

struct TopCell {
  std::string text;
  double number = 0;  // what a column of numbers is sorted by
};

struct TopRow {
  std::uint64_t id = 0;  // incarnation of the window or link
  bool isAlarm = false;  // somebody should look at it: stalled, stopped, dead, refused
  std::vector<TopCell> cells;
};

struct TopTable {
  std::vector<std::string> headings;  // '>': numbers, as in Table
  std::vector<TopRow> rows;
};

// Fit into 80 columns as long as names do.
[[nodiscard]] TopTable topServers(const Look& look);
[[nodiscard]] TopTable topClients(const Look& look);
// Of a server or a client.
[[nodiscard]] TopTable topLinks(const Look& look, const WindowView& window);
// One row for each fact.
[[nodiscard]] TopTable topLink(const Look& look, const LinkView& link);

}  // namespace mpf::tools
