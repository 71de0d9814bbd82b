// SPDX-License-Identifier: MIT
#include <mpf/server/programs/server_log.h>

#include <mutex>
#include <spdlog/async.h>
#include <spdlog/sinks/base_sink.h>
#include <utility>

#include <mpf/base/print_error.h>
#include <mpf/base/signals_blocked.h>

namespace mpf {
namespace {

constexpr std::size_t kLinesThatMayWait = 1024;

// Writes to stderr, one line for each message: text of clients and of other hosts can neither add a line nor command a
// terminal. What cannot be written is lost.
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

}  // namespace

ServerLog::ServerLog(const std::string& program, const std::string& level) {
  const SignalsBlocked blocked;  // for the thread that writes
  writer_ = std::make_shared<spdlog::details::thread_pool>(kLinesThatMayWait, 1);
  auto errors = std::make_shared<PrintableSink>();
  logger_ = std::make_shared<spdlog::async_logger>(program, std::move(errors), writer_, spdlog::async_overflow_policy::overrun_oldest);
  logger_->set_level(spdlog::level::from_str(level));
  logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %l %n: %v");
}

const std::vector<std::string>& ServerLog::levels() {
  static const std::vector<std::string> names{"trace", "debug", "info", "warning", "error", "critical", "off"};
  return names;
}

}  // namespace mpf
