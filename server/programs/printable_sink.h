// SPDX-License-Identifier: MIT
// PrintableSink: where the log of a program goes to: stderr, one line for each message,
// printable().
//
// Threads  any.
// Crash    a line is one call of write(); what stderr does not take is lost, and nothing fails.
// Trust    text of clients and of other hosts can neither add a line nor command a terminal.
#pragma once

#include <mutex>
#include <spdlog/sinks/base_sink.h>

#include "base/print_error.h"

namespace mpf {

class PrintableSink final : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    const auto text = printable({message.payload.data(), message.payload.size()});
    auto shown = message;
    shown.payload = text;
    spdlog::memory_buf_t line;
    formatter_->format(shown, line);
    writeError({line.data(), line.size()});
  }
  void flush_() override {}  // nothing is buffered
};

}  // namespace mpf
