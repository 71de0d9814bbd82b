// SPDX-License-Identifier: MIT
#include "tools/report/screen.h"

#include <unistd.h>

#include <clocale>
#include <curses.h>
#include <fmt/format.h>
#include <stdexcept>

namespace mpf::tools {
namespace {

constexpr int kEscape = 27;
constexpr short kAlarmColours = 1;

int attributesOf(TopLine::Style style) {
  switch (style) {
    case TopLine::Style::plain:
      return A_NORMAL;
    case TopLine::Style::title:
      return A_BOLD;
    case TopLine::Style::heading:
      return A_UNDERLINE;
    case TopLine::Style::selected:
      return A_REVERSE;
    case TopLine::Style::alarm:
      return static_cast<int>(A_BOLD |
                              static_cast<unsigned>(has_colors() ? COLOR_PAIR(kAlarmColours) : 0));
    case TopLine::Style::selectedAlarm:
      return static_cast<int>(A_REVERSE |
                              static_cast<unsigned>(attributesOf(TopLine::Style::alarm)));
    case TopLine::Style::keys:
      return A_DIM;
  }
  return A_NORMAL;
}

int keyOf(int code) {
  switch (code) {
    case KEY_UP:
      return kTopUp;
    case KEY_DOWN:
      return kTopDown;
    case KEY_PPAGE:
      return kTopPageUp;
    case KEY_NPAGE:
      return kTopPageDown;
    default:
      return code;
  }
}

}  // namespace

Screen::Screen() {
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDOUT_FILENO) == 0) {
    throw std::runtime_error(
        "stdin or stdout is not a terminal; `mpf top --batch 1` prints the tables once");
  }
  std::setlocale(LC_CTYPE, "");
  if (newterm(nullptr, stdout, stdin) == nullptr) {
    throw std::runtime_error(
        "the type of this terminal ($TERM) is unknown; `mpf top --batch 1` prints the tables "
        "once");
  }
  cbreak();
  noecho();
  nodelay(stdscr, TRUE);
  keypad(stdscr, TRUE);
  set_escdelay(25);
  curs_set(0);
  if (has_colors()) {
    start_color();
    use_default_colors();
    init_pair(kAlarmColours, COLOR_RED, -1);
  }
}

Screen::~Screen() { endwin(); }

int Screen::rows() const noexcept { return LINES; }

void Screen::draw(const std::vector<TopLine>& lines) {
  erase();
  int row = 0;
  for (const auto& line : lines) {
    // A line that is too long would continue in the next row: it is cut here, and clrtoeol()
    // removes the remains of wide characters.
    const bool isSelected =
        line.style == TopLine::Style::selected || line.style == TopLine::Style::selectedAlarm;
    const auto text = fmt::format("{:<{}.{}}", line.text, isSelected ? COLS : 0, COLS);
    move(row, 0);
    clrtoeol();
    attrset(attributesOf(line.style));
    addstr(text.c_str());
    ++row;
  }
  attrset(A_NORMAL);
  refresh();
}

std::optional<int> Screen::tryKey() {
  switch (const int code = getch(); code) {
    case ERR:
      return std::nullopt;
    case KEY_RESIZE:
      return 0;
    case '\n':
    case '\r':
    case KEY_ENTER:
      return kTopEnter;
    case kEscape:
      return kTopBack;
    case '\t':
      return kTopTab;
    case KEY_BACKSPACE:
    case 127:
    case '\b':
      return kTopErase;
    default:
      return keyOf(code);
  }
}

}  // namespace mpf::tools
