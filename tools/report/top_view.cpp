// SPDX-License-Identifier: MIT
#include "tools/report/top_view.h"

#include <algorithm>
#include <fmt/format.h>
#include <sstream>

#include "tools/text/table.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr std::ptrdiff_t kPage = 10;

bool isNumeric(const std::string& heading) { return heading.starts_with('>'); }

const LinkView* findLink(const SnapshotDelta& delta, std::uint64_t incarnation) {
  for (const auto* windows : {&delta.now().servers, &delta.now().clients}) {
    for (const auto& window : *windows) {
      const auto found = std::ranges::find(window.links, incarnation, &LinkView::incarnation);
      if (found != window.links.end()) return &*found;
    }
  }
  return nullptr;
}

SnapshotDelta::RouterLineOf findLine(const SnapshotDelta& delta, std::uint64_t id) {
  for (const auto& router : delta.now().routers) {
    const auto found = std::ranges::find_if(
        router.lines, [&](const RouterLineView& line) { return topId(router, line) == id; });
    if (found != router.lines.end()) return {&router, &*found};
  }
  return {};
}

std::vector<std::string> textLines(const TopTable& table, std::size_t sortColumn) {
  auto headings = table.headings;
  if (sortColumn < headings.size()) headings[sortColumn] += '*';
  Table columns(headings);
  for (const auto& row : table.rows) {
    std::vector<std::string> cells;
    cells.reserve(row.cells.size());
    for (const auto& cell : row.cells) cells.push_back(cell.text);
    columns.add(std::move(cells));
  }
  std::istringstream text(columns.text());
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

}  // namespace

void TopView::show(std::shared_ptr<const SnapshotDelta> delta) {
  delta_ = std::move(delta);
  refresh();
}

TopTable TopView::table() {
  isGone_ = false;
  auto& place = places_.back();
  switch (place.page) {
    case Page::servers:
      return topServers(*delta_);
    case Page::clients:
      return topClients(*delta_);
    case Page::routers:
      return topRouters(*delta_);
    case Page::links:
      if (const auto* window = delta_->find(place.of)) {
        place.title = topTitle(*delta_, *window);
        return topLinks(*delta_, *window);
      }
      break;
    case Page::link:
      if (const auto* link = findLink(*delta_, place.of)) {
        place.title = topTitle(*delta_, *link);
        return topLink(*delta_, *link);
      }
      break;
    case Page::line:
      if (const auto [router, line] = findLine(*delta_, place.of); line != nullptr) {
        place.title = topTitle(*delta_, *router, *line);
        return topLine(*delta_, *router, *line);
      }
      break;
    case Page::help:
      return topHelp();
  }
  isGone_ = true;
  return {{"GONE: " + place.title + "; Esc goes back"}, {}};
}

// Lists of details and of keys are not sorted.
bool TopView::isSorted() const noexcept {
  const auto page = places_.back().page;
  return page != Page::link && page != Page::line && page != Page::help;
}

void TopView::refresh() {
  if (!delta_) return;
  table_ = table();
  if (isSorted()) {
    std::erase_if(table_.rows, [this](const TopRow& row) {
      return std::ranges::none_of(row.cells, [this](const TopCell& cell) {
        return cell.text.find(filter_) != std::string::npos;
      });
    });
    sort(table_);
  }
  // If the selected row no longer exists, the row in its place becomes the selected one.
  auto& place = places_.back();
  const auto found = std::ranges::find(table_.rows, place.selected, &TopRow::id);
  if (found != table_.rows.end()) {
    index_ = static_cast<std::size_t>(found - table_.rows.begin());
  } else if (!table_.rows.empty()) {
    index_ = std::min(index_, table_.rows.size() - 1);
    place.selected = table_.rows[index_].id;
  }
}

// Sorts numbers from the largest down, and texts from A to Z.
void TopView::sort(TopTable& table) const {
  const auto& place = places_.back();
  if (place.sortColumn >= table.headings.size()) return;
  const auto column = place.sortColumn;
  const bool numeric = isNumeric(table.headings[column]);
  std::ranges::stable_sort(table.rows, [&](const TopRow& a, const TopRow& b) {
    const auto& left = place.isReversed ? b.cells[column] : a.cells[column];
    const auto& right = place.isReversed ? a.cells[column] : b.cells[column];
    return numeric ? left.number > right.number : left.text < right.text;
  });
}

TopView::Page TopView::afterTab(Page page) noexcept {
  return page == Page::servers   ? Page::clients
         : page == Page::clients ? Page::routers
                                 : Page::servers;
}

bool TopView::handle(int key) {
  if (isTyping_) {
    editFilter(key);
    return true;
  }
  auto& place = places_.back();
  switch (key) {
    case 'q':
      return false;
    case kTopUp:
    case 'k':
      move(-1);
      break;
    case kTopDown:
    case 'j':
      move(1);
      break;
    case kTopPageUp:
      move(-kPage);
      break;
    case kTopPageDown:
      move(kPage);
      break;
    case kTopEnter:
      open();
      break;
    case kTopBack:
      if (places_.size() > 1) places_.pop_back();
      break;
    case kTopTab:
      places_ = {Place{.page = afterTab(places_.front().page)}};
      break;
    case '?':
    case 'h':
      if (place.page != Page::help) places_.push_back(Place{.page = Page::help});
      index_ = 0;
      break;
    case 's':
      place.sortColumn = (place.sortColumn + 1) % std::max<std::size_t>(table_.headings.size(), 1);
      break;
    case 'r':
      place.isReversed = !place.isReversed;
      break;
    case '/':
      isTyping_ = true;
      filter_.clear();
      break;
    default:
      break;
  }
  refresh();
  return true;
}

void TopView::editFilter(int key) {
  if (key == kTopEnter || key == kTopBack) isTyping_ = false;
  if (key == kTopBack) filter_.clear();
  if (key == kTopErase && !filter_.empty()) filter_.pop_back();
  if (key >= ' ' && key < 127) filter_ += static_cast<char>(key);
  refresh();
}

void TopView::setFilter(std::string filter) {
  filter_ = std::move(filter);
  refresh();
}

bool TopView::trySortBy(const std::string& heading) {
  for (std::size_t column = 0; column < table_.headings.size(); ++column) {
    const auto& name = table_.headings[column];
    if ((isNumeric(name) ? name.substr(1) : name) != heading) continue;
    places_.back().sortColumn = column;
    refresh();
    return true;
  }
  return false;
}

void TopView::showClients() {
  places_ = {Place{.page = Page::clients}};
  refresh();
}

void TopView::showRouters() {
  places_ = {Place{.page = Page::routers}};
  refresh();
}

void TopView::move(std::ptrdiff_t by) {
  if (table_.rows.empty()) return;
  const auto last = static_cast<std::ptrdiff_t>(table_.rows.size()) - 1;
  index_ = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(index_) + by, 0, last));
  places_.back().selected = table_.rows[index_].id;
}

void TopView::open() {
  const auto page = places_.back().page;
  if (table_.rows.empty() || !isSorted()) return;
  const auto next = page == Page::routers ? Page::line
                    : page == Page::links ? Page::link
                                          : Page::links;
  places_.push_back(Place{.page = next, .of = table_.rows[index_].id});
  index_ = 0;
}

// What the screen shows, and its state.
std::string TopView::title() const {
  const auto& place = places_.back();
  const auto what = place.page == Page::help ? "keys and columns"
                    : place.title.empty()    ? counts()
                                             : place.title;
  return fmt::format("mpf top  {}: {}", delta_->now().backplane, what);
}

std::string TopView::counts() const {
  const auto& snapshot = delta_->now();
  std::size_t links = 0;
  double requests = 0;
  for (const auto& server : snapshot.servers) {
    links += server.links.size();
    requests += delta_->ratesOf(server).receivedPerSecond;
  }
  std::size_t lines = 0;
  std::size_t cut = 0;
  for (const auto& router : snapshot.routers) {
    lines += router.lines.size();
    cut += static_cast<std::size_t>(std::ranges::count_if(router.lines, [&](const auto& line) {
      return delta_->stateOf(router, line) != "connected";
    }));
  }
  auto text =
      cut == 0 ? std::string() : fmt::format("{} of {} cut, ", cut, counted(lines, "connection"));
  text += fmt::format("{}, {}, {}, {:.0f} requests/s", counted(snapshot.servers.size(), "server"),
                      counted(snapshot.clients.size(), "client"), counted(links, "link"), requests);
  if (lines != 0 && cut == 0) text += ", " + counted(lines, "connection");
  if (!snapshot.problems.empty())
    text += fmt::format(", {} (mpf ls)", counted(snapshot.problems.size(), "problem"));
  return text;
}

std::vector<TopLine> TopView::lines(int rows) const {
  if (!delta_) return {};
  std::vector<TopLine> lines{{title(), TopLine::Style::title}};
  const auto text =
      textLines(table_, isSorted() && !isGone_ ? places_.back().sortColumn : SIZE_MAX);
  lines.push_back({text.front(), TopLine::Style::heading});
  const bool isWhole = rows == 0;
  const auto room = isWhole ? table_.rows.size() : static_cast<std::size_t>(std::max(rows - 3, 1));
  const auto first = isWhole || index_ < room ? 0 : index_ - room + 1;
  for (auto i = first; i < std::min(first + room, table_.rows.size()); ++i) {
    const bool isSelected = !isWhole && i == index_;
    const auto plain = isSelected ? TopLine::Style::selected : TopLine::Style::plain;
    const auto alarm = isSelected ? TopLine::Style::selectedAlarm : TopLine::Style::alarm;
    lines.push_back({text[i + 1], table_.rows[i].isAlarm ? alarm : plain});
  }
  if (isWhole) return lines;
  lines.resize(static_cast<std::size_t>(std::max(rows - 1, 2)));
  const auto filter = filter_.empty() && !isTyping_
                          ? ""
                          : fmt::format("filter: {}{}  ", filter_, isTyping_ ? "_" : "");
  lines.push_back({filter + (isTyping_ ? "Enter keep  Esc drop" : kKeys), TopLine::Style::keys});
  return lines;
}

}  // namespace mpf::tools
