// SPDX-License-Identifier: MIT
// TopView: what `mpf top` shows and how keys change it: which table, sorted, filtered, which row is selected. Knows no terminal.
//
//   servers ◄─Tab─► clients        Enter: its links ─ Enter: one link        Esc: back
//
// Threads  one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <mpf/tools/top_rows.h>

namespace mpf::tools {

// A line of the screen and how it looks.
struct TopLine {
  enum class Style { plain, title, heading, selected, alarm, keys };
  std::string text;
  Style style = Style::plain;
};

// Characters are themselves.
enum TopKey : int { kTopUp = 0x110000, kTopDown, kTopPageUp, kTopPageDown, kTopEnter, kTopBack, kTopTab, kTopErase };

class TopView {
 public:
  static constexpr const char* kKeys = "q quit  Tab servers/clients  Enter open  Esc back  s sort  r reverse  / filter";

  // A newer look; selection and order stay.
  void show(std::shared_ptr<const Look> look);
  // False when the key ends the program.
  [[nodiscard]] bool handle(int key);
  void setFilter(std::string filter);
  // Sorts by the column of this heading. False when no such column is there.
  [[nodiscard]] bool trySortBy(const std::string& heading);
  void showClients();

  // All lines, for a screen of `rows`; 0 for as many as it takes, without keys and selection.
  [[nodiscard]] std::vector<TopLine> lines(int rows) const;

 private:
  enum class Page { servers, clients, links, link };
  struct Place {
    Page page = Page::servers;
    std::uint64_t of = 0;  // window or link that was opened
    std::size_t sortColumn = 0;
    bool isReversed = false;
    std::uint64_t selected = 0;  // id
  };
  [[nodiscard]] TopTable table() const;
  void refresh();
  void sort(TopTable& table) const;
  [[nodiscard]] std::string title() const;
  void move(std::ptrdiff_t by);
  void open();
  void editFilter(int key);

  std::shared_ptr<const Look> look_;
  std::vector<Place> places_{Place{}};  // the last one is shown
  std::string filter_;
  bool isTyping_ = false;  // the filter
  TopTable table_;         // of the last place: filtered, sorted
  std::size_t index_ = 0;  // of the selected row, when it was last seen
};

}  // namespace mpf::tools
