// SPDX-License-Identifier: MIT
#include <mpf/server/programs/server_log.h>

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <utility>

#include <mpf/base/signals_blocked.h>
#include <mpf/server/message_server.h>

namespace mpf {
namespace {

constexpr std::size_t kLinesThatMayWait = 1024;

}  // namespace

ServerLog::ServerLog(const std::string& program, const std::string& level) {
  const SignalsBlocked blocked;  // for the thread that writes
  writer_ = std::make_shared<spdlog::details::thread_pool>(kLinesThatMayWait, 1);
  auto errors = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  logger_ = std::make_shared<spdlog::async_logger>(program, std::move(errors), writer_, spdlog::async_overflow_policy::overrun_oldest);
  logger_->set_level(spdlog::level::from_str(level));
  logger_->set_pattern("%Y-%m-%d %H:%M:%S.%e %l %n: %v");
}

void logShortages(MessageServer& server, const ServerLog& log) {
  server.onShortage([&log, name = server.getName()](const std::string& why) {
    if (why.empty()) return log->info(R"("{}" accepts clients again)", name);
    log->warn(R"("{}" cannot accept another client: {}; start it with higher limits (ulimit -n))", name, why);
  });
}

const std::vector<std::string>& ServerLog::levels() {
  static const std::vector<std::string> names{"trace", "debug", "info", "warning", "error", "critical", "off"};
  return names;
}

}  // namespace mpf
