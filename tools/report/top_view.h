// SPDX-License-Identifier: MIT
// TopView: what `mpf top` shows and how keys change it: which table, sorted, filtered, which row is
// selected. Knows no terminal.
//
//   servers ─Tab─► clients ─Tab─► routers ─Tab─► servers     Enter: its links ─ Enter: one link     ?: help     Esc: back
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

// Characters are themselves.
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

  // A newer look; selection and order stay.
  void show(std::shared_ptr<const SnapshotDelta> delta);
  // False when the key ends the program.
  [[nodiscard]] bool handle(int key);
  void setFilter(std::string filter);
  // Sorts by the column of this heading. False when no such column is there.
  [[nodiscard]] bool trySortBy(const std::string& heading);
  void showClients();
  void showRouters();

  // All lines, for a screen of `rows`; 0 for as many as it takes, without keys and selection.
  [[nodiscard]] std::vector<TopLine> lines(int rows) const;

 private:
  enum class Page { servers, clients, routers, links, link, line, help };
  struct Place {
    Page page = Page::servers;
    std::uint64_t of = 0;  // what was opened: id of its row
    std::string title =
        {};  // of that, when it was last seen; NOLINT(readability-redundant-member-init): g++ wants it
    std::size_t sortColumn = 0;
    bool isReversed = false;
    std::uint64_t selected = 0;  // id
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
  bool isTyping_ = false;  // the filter
  bool isGone_ = false;  // what was opened
  TopTable table_;  // of the last place: filtered, sorted
  std::size_t index_ = 0;  // of the selected row, when it was last seen
};

}  // namespace mpf::tools
