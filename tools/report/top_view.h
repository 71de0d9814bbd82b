// SPDX-License-Identifier: MIT
// TopView: the tables that `mpf top` shows, with sorting, filter and selection, and the effect of
// each key. Independent of the terminal.
//
//   servers ─Tab─► clients ─Tab─► routers ─Tab─► servers
//   Enter: its links ─ Enter: one link     ?: help     Esc: back
//
// Threads  one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/report/top_rows.h"

namespace mpf::tools {

// A line of the screen and how it looks.
struct TopLine {
  enum class Style { plain, title, heading, selected, alarm, selectedAlarm, keys };
  std::string text;
  Style style = Style::plain;
};

// Codes of keys that are not characters. The code of a character is the character.
enum TopKey : int {
  kTopUp = 0x110000,
  kTopDown,
  kTopPageUp,
  kTopPageDown,
  kTopEnter,
  kTopBack,
  kTopTab,
  kTopErase
};

class TopView {
 public:
  static constexpr const char* kKeys =
      "q quit  ? help  Tab next  Enter open  Esc back  s sort  r reverse  / filter";

  // Shows a newer delta; selection and order stay.
  void show(std::shared_ptr<const SnapshotDelta> delta);
  // False when the key ends the program.
  [[nodiscard]] bool handle(int key);
  void setFilter(std::string filter);
  // Sorts by the column with this heading. False when no such column exists.
  [[nodiscard]] bool trySortBy(const std::string& heading);
  void showClients();
  void showRouters();

  // The lines for a screen of `rows`. For 0, all lines, without keys and selection.
  [[nodiscard]] std::vector<TopLine> lines(int rows) const;

 private:
  enum class Page { servers, clients, routers, links, link, line, help };
  struct Place {
    Page page = Page::servers;
    std::uint64_t of = 0;  // id of the row that was opened
    // Title of that row when it was last seen.
    std::string title = {};
    std::size_t sortColumn = 0;
    bool isReversed = false;
    std::uint64_t selected = 0;  // id of the selected row
  };
  [[nodiscard]] static Page afterTab(Page page) noexcept;
  [[nodiscard]] TopTable table();
  [[nodiscard]] bool isSorted() const noexcept;
  void refresh();
  void sort(TopTable& table) const;
  [[nodiscard]] std::string title() const;
  [[nodiscard]] std::string counts() const;
  void move(std::ptrdiff_t by);
  void open();
  void editFilter(int key);

  std::shared_ptr<const SnapshotDelta> delta_;
  std::vector<Place> places_{Place{}};  // the last one is shown
  std::string filter_;
  bool isTyping_ = false;  // the user is typing a filter
  bool isGone_ = false;    // the opened row no longer exists
  TopTable table_;         // of the last place: filtered, sorted
  std::size_t index_ = 0;  // of the selected row, when it was last seen
};

}  // namespace mpf::tools
