// SPDX-License-Identifier: MIT
// Terminal: a program on a pseudo-terminal, and the screen that a user would see (libvterm). The
// program is killed at the end of the test.
//
//   Terminal top({MPF_TEST_TOOL, "top"}, 24, 80);
//   ASSERT_TRUE(top.waitFor("SERVER"));
//   top.type("q");
//   EXPECT_EQ(top.wait(), 0);
//
// Threads  one thread.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include <vterm.h>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class Terminal {
 public:
  // Runs `command`: a path and its arguments.
  Terminal(std::vector<std::string> command, int rows, int columns)
      : terminal_(vterm_new(rows, columns)), rows_(rows), columns_(columns) {
    vterm_set_utf8(terminal_.get(), 1);
    screen_ = vterm_obtain_screen(terminal_.get());
    vterm_screen_enable_altscreen(screen_, 1);
    vterm_screen_set_callbacks(screen_, &kCallbacks, this);
    vterm_screen_reset(screen_, 1);
    openLine();
    start(std::move(command));
  }
  ~Terminal() {
    if (pid_ == 0) return;
    signal(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void type(std::string_view keys) const {
    checkCall(::write(master_.get(), keys.data(), keys.size()), "write", "keys");
  }
  void signal(int number) const { ::kill(pid_, number); }
  void resize(int rows, int columns) {
    std::tie(rows_, columns_) = std::pair(rows, columns);
    vterm_set_size(terminal_.get(), rows, columns);
    setSize();  // the kernel sends SIGWINCH
  }
  // Waits until `text` is on the screen. Returns false if the program ends first.
  bool waitFor(std::string_view text) {
    while (screen().find(text) == std::string::npos) {
      if (!readMore()) return screen().find(text) != std::string::npos;
    }
    return true;
  }
  // Waits until `text` is not on the screen.
  bool waitUntilGone(std::string_view text) {
    while (screen().find(text) != std::string::npos) {
      if (!readMore()) return screen().find(text) == std::string::npos;
    }
    return true;
  }
  // Waits until the program has ended. Returns its exit status, or minus the signal that killed it.
  int wait() {
    while (readMore()) continue;
    int status = 0;
    ::waitpid(std::exchange(pid_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  // Whether the program has restored the terminal: normal screen, line mode, echo.
  [[nodiscard]] bool isRestored() const {
    termios now{};
    checkCall(::tcgetattr(slave_.get(), &now), "tcgetattr", "the terminal");
    return !isAlternate_ && (now.c_lflag & (ICANON | ECHO)) == (ICANON | ECHO);
  }
  [[nodiscard]] std::string row(int number) const {
    std::string text(static_cast<std::size_t>(columns_) * 4, '\0');
    text.resize(vterm_screen_get_text(screen_, text.data(), text.size(),
                                      {number, number + 1, 0, columns_}));
    return text;
  }
  // The attributes of the first character of a row.
  struct Look {
    bool isRed = false;
    bool isReversed = false;
  };
  [[nodiscard]] Look look(int number) const {
    constexpr std::uint8_t kRed = 1;
    VTermScreenCell cell{};
    vterm_screen_get_cell(screen_, {number, 0}, &cell);
    // A terminal may show bold text in the bright color.
    return {VTERM_COLOR_IS_INDEXED(&cell.fg) && cell.fg.indexed.idx % 8 == kRed,
            cell.attrs.reverse != 0};
  }
  [[nodiscard]] std::string screen() const {
    std::string text;
    for (int number = 0; number < rows_; ++number) text += row(number) + '\n';
    return text;
  }

 private:
  static int onProperty(VTermProp property, VTermValue* value, void* self) {
    if (property == VTERM_PROP_ALTSCREEN)
      static_cast<Terminal*>(self)->isAlternate_ = value->boolean != 0;
    return 1;
  }
  static constexpr VTermScreenCallbacks kCallbacks{nullptr, nullptr, nullptr, onProperty,
                                                   nullptr, nullptr, nullptr, nullptr};

  void openLine() {
    master_.reset(checkCall(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC), "posix_openpt"));
    checkCall(::grantpt(master_.get()), "grantpt");
    checkCall(::unlockpt(master_.get()), "unlockpt");
    std::array<char, 64> name{};
    if (const int error = ::ptsname_r(master_.get(), name.data(), name.size()); error != 0)
      throwSystemError(error, "ptsname_r", "pty");
    slave_.reset(
        checkCall(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open", name.data()));
    setSize();
  }
  void setSize() const {
    const winsize size{static_cast<unsigned short>(rows_), static_cast<unsigned short>(columns_), 0,
                       0};
    checkCall(::ioctl(master_.get(), TIOCSWINSZ, &size), "resize", "the terminal");
  }
  void start(std::vector<std::string> command) {
    command.insert(command.begin(), {"/usr/bin/env", "TERM=xterm-256color", "LC_ALL=C.UTF-8"});
    std::vector<char*> arguments;
    for (auto& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_ = checkCall(::fork(), "fork");
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::setsid();
      ::ioctl(slave_.get(), TIOCSCTTY, 0);
      for (const int end : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(slave_.get(), end);
      ::execv(arguments[0], arguments.data());
      ::_exit(127);
    }
    process_.reset(checkCall(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)), "pidfd_open"));
  }
  // Draws the next output. Returns false if the program has ended and all its output is drawn.
  bool readMore() {
    std::array<pollfd, 2> ready{{{master_.get(), POLLIN, 0}, {process_.get(), POLLIN, 0}}};
    checkCall(retryInterrupted([&] { return ::poll(ready.data(), ready.size(), -1); }), "poll");
    // The program may have written its last output after poll() had looked at the terminal.
    if (ready[0].revents == 0) ::poll(ready.data(), 1, 0);
    if ((ready[0].revents & POLLIN) == 0) return false;
    std::array<char, 4096> bytes{};
    const auto got = ::read(master_.get(), bytes.data(), bytes.size());
    if (got > 0) vterm_input_write(terminal_.get(), bytes.data(), static_cast<std::size_t>(got));
    return got > 0;
  }

  struct Free {
    void operator()(VTerm* terminal) const { vterm_free(terminal); }
  };
  std::unique_ptr<VTerm, Free> terminal_;
  VTermScreen* screen_ = nullptr;
  int rows_;
  int columns_;
  bool isAlternate_ = false;
  FileDescriptor master_;
  FileDescriptor slave_;
  FileDescriptor process_;
  pid_t pid_ = 0;
};

}  // namespace mpf::test
