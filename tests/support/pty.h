// SPDX-License-Identifier: MIT
// Pty: a pair of pseudo-terminals under a name that the test chooses. The instrument uses the
// master; a port opens the name.
//
//   instrument ── master ══ kernel ══ slave /dev/pts/N ◄── linkPath ── port
//
// The destructor hangs the line up, as if an adapter were unplugged. The object keeps the slave
// open, so that the master does not see a hang-up each time the port closes it, and so that tests
// can read the settings of the line.
#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::test {

class Pty {
 public:
  explicit Pty(std::string linkPath) : linkPath_(std::move(linkPath)) {
    master_.reset(checkCall(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC), "posix_openpt"));
    checkCall(::grantpt(master_.get()), "grantpt");
    checkCall(::unlockpt(master_.get()), "unlockpt");
    std::string slave(64, '\0');
    if (const int error = ::ptsname_r(master_.get(), slave.data(), slave.size()); error != 0)
      throwSystemError(error, "ptsname_r", linkPath_);
    slave.resize(slave.find('\0'));
    slave_.reset(checkCall(::open(slave.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open", slave));
    termios raw{};
    checkCall(::tcgetattr(slave_.get(), &raw), "tcgetattr", slave);
    ::cfmakeraw(&raw);
    checkCall(::tcsetattr(slave_.get(), TCSANOW, &raw), "tcsetattr", slave);
    std::filesystem::remove(linkPath_);
    std::filesystem::create_symlink(slave, linkPath_);
  }
  ~Pty() {
    std::error_code ignored;
    std::filesystem::remove(linkPath_, ignored);
  }
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  [[nodiscard]] const FileDescriptor& master() const noexcept { return master_; }
  // The settings of the line.
  [[nodiscard]] termios settings() const {
    termios now{};
    checkCall(::tcgetattr(slave_.get(), &now), "tcgetattr", linkPath_);
    return now;
  }

 private:
  std::string linkPath_;
  FileDescriptor slave_;
  FileDescriptor master_;
};

}  // namespace mpf::test
