// SPDX-License-Identifier: MIT
// PrologixStand: a model Prologix with two instruments, at the far end of a TCP connection or of a
// pseudo-terminal.
//
//   PrologixStand stand(PrologixStand::Line::tcp);
//   PrologixController controller(stand.address(), Watchdog::kPatience);
//   stand.plugIn();                     // again after each unplug()
//
// Threads  one at a time.
#pragma once

#include <fcntl.h>

#include <gtest/gtest.h>
#include <memory>
#include <string>

#include "drivers/gpib/prologix_model.h"
#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/serial/terminal_server.h"
#include "tests/support/pty.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {

class PrologixStand {
 public:
  enum class Line : std::uint8_t { tcp, terminal };

  explicit PrologixStand(Line line) : line_(line) {
    model.attach({.primary = 22}, echo);
    model.attach({.primary = 9, .secondary = 5}, other);
  }

  [[nodiscard]] std::string address() const {
    return line_ == Line::tcp ? server_.address().toString() : folder_.file("ttyUSB0");
  }
  // Connects the model to the port that a controller has opened, or opens soon.
  void plugIn() {
    if (line_ == Line::tcp) return model.connect(server_.accept());
    pty_ = std::make_unique<Pty>(address());
    model.connect(FileDescriptor(
        checkCall(::fcntl(pty_->master().get(), F_DUPFD_CLOEXEC, 0), "fcntl F_DUPFD_CLOEXEC")));
  }
  void unplug() {
    model.hangUp();
    pty_.reset();
  }

  const std::shared_ptr<EchoInstrument> echo = std::make_shared<EchoInstrument>();  // address 22
  const std::shared_ptr<EchoInstrument> other = std::make_shared<EchoInstrument>();  // 9.5
  PrologixModel model;

 private:
  const Line line_;
  TerminalServer server_;
  TemporaryFolder folder_;
  std::unique_ptr<Pty> pty_;
};

// For test suites that run on both kinds of line.
inline const auto kBothLines =
    testing::Values(PrologixStand::Line::tcp, PrologixStand::Line::terminal);
inline std::string nameOfLine(const testing::TestParamInfo<PrologixStand::Line>& line) {
  return line.param == PrologixStand::Line::tcp ? "tcp" : "terminal";
}

}  // namespace mpf::test
