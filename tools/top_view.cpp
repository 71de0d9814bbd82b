// SPDX-License-Identifier: MIT
#include <mpf/tools/top_view.h>

#include <algorithm>
#include <fmt/format.h>
#include <sstream>

#include <mpf/tools/table.h>

namespace mpf::tools {
namespace {

constexpr std::ptrdiff_t kPage = 10;

bool isNumeric(const std::string& heading) { return heading.starts_with('>'); }

const LinkView* findLink(const Look& look, std::uint64_t incarnation) {
  for (const auto* windows : {&look.now().servers, &look.now().clients}) {
    for (const auto& window : *windows) {
      const auto found = std::ranges::find(window.links, incarnation, &LinkView::incarnation);
      if (found != window.links.end()) return &*found;
    }
  }
  return nullptr;
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

void TopView::show(std::shared_ptr<const Look> look) {
  look_ = std::move(look);
  refresh();
}

TopTable TopView::table() const {
  const auto& place = places_.back();
  switch (place.page) {
    case Page::servers:
      return topServers(*look_);
    case Page::clients:
      return topClients(*look_);
    case Page::links:
      if (const auto* window = look_->find(place.of)) return topLinks(*look_, *window);
      break;
    case Page::link:
      if (const auto* link = findLink(*look_, place.of)) return topLink(*look_, *link);
      break;
  }
  return {{"GONE"}, {}};
}

void TopView::refresh() {
  if (!look_) return;
  table_ = table();
  if (places_.back().page != Page::link) {
    std::erase_if(table_.rows, [this](const TopRow& row) {
      return std::ranges::none_of(row.cells, [this](const TopCell& cell) { return cell.text.find(filter_) != std::string::npos; });
    });
    sort(table_);
  }
  // A row that has gone hands the selection to the one in its place.
  auto& place = places_.back();
  const auto found = std::ranges::find(table_.rows, place.selected, &TopRow::id);
  if (found != table_.rows.end()) {
    index_ = static_cast<std::size_t>(found - table_.rows.begin());
  } else if (!table_.rows.empty()) {
    index_ = std::min(index_, table_.rows.size() - 1);
    place.selected = table_.rows[index_].id;
  }
}

// Numbers from the largest, texts from A.
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
      places_ = {Place{.page = places_.front().page == Page::servers ? Page::clients : Page::servers}};
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

void TopView::move(std::ptrdiff_t by) {
  if (table_.rows.empty()) return;
  const auto last = static_cast<std::ptrdiff_t>(table_.rows.size()) - 1;
  index_ = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(index_) + by, 0, last));
  places_.back().selected = table_.rows[index_].id;
}

void TopView::open() {
  const auto page = places_.back().page;
  if (table_.rows.empty() || page == Page::link) return;
  const auto next = page == Page::links ? Page::link : Page::links;
  places_.push_back(Place{.page = next, .of = table_.rows[index_].id});
  index_ = 0;
}

std::string TopView::title() const {
  const auto& survey = look_->now();
  std::size_t links = 0;
  double requests = 0;
  for (const auto& server : survey.servers) {
    links += server.links.size();
    requests += look_->ratesOf(server).receivedPerSecond;
  }
  return fmt::format("mpf top  {}: {} servers, {} clients, {} links, {:.0f} requests/s", survey.backplane, survey.servers.size(),
                     survey.clients.size(), links, requests) +
         (survey.problems.empty() ? "" : fmt::format(", {} problems (mpf ls)", survey.problems.size()));
}

std::vector<TopLine> TopView::lines(int rows) const {
  if (!look_) return {};
  std::vector<TopLine> lines{{title(), TopLine::Style::title}};
  const auto text = textLines(table_, places_.back().page == Page::link ? SIZE_MAX : places_.back().sortColumn);
  lines.push_back({text.front(), TopLine::Style::heading});
  const bool isWhole = rows == 0;
  const auto room = isWhole ? table_.rows.size() : static_cast<std::size_t>(std::max(rows - 3, 1));
  const auto first = isWhole || index_ < room ? 0 : index_ - room + 1;
  for (auto i = first; i < std::min(first + room, table_.rows.size()); ++i) {
    auto style = table_.rows[i].isAlarm ? TopLine::Style::alarm : TopLine::Style::plain;
    if (!isWhole && i == index_) style = TopLine::Style::selected;
    lines.push_back({text[i + 1], style});
  }
  if (isWhole) return lines;
  lines.resize(static_cast<std::size_t>(std::max(rows - 1, 2)));
  const auto filter = filter_.empty() && !isTyping_ ? "" : fmt::format("filter: {}{}  ", filter_, isTyping_ ? "_" : "");
  lines.push_back({filter + (isTyping_ ? "Enter keep  Esc drop" : kKeys), TopLine::Style::keys});
  return lines;
}

}  // namespace mpf::tools
