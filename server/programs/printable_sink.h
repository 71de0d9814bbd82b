// SPDX-License-Identifier: MIT
// PrintableSink: writes log messages to stderr, each as one line of printable() text.
//
// Threads  any.
// Errors   a line is one call of write(). Bytes that stderr does not accept are lost silently.
// Trust    text from clients and other hosts can neither add lines nor send escape sequences to a
//          terminal.
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
