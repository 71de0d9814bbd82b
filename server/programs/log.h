// SPDX-License-Identifier: MIT
// Log: the log of a program, with a limit on the number of lines of one kind (LogLimiter).
//
//   log.info("{} is connected", port)
//   const Log ofThisRemote = log.forObject();    // its lines have separate limits
//
// A kind is one statement in the source for one object. Do not call forObject() for objects that
// other users can create, such as clients: each would add lines without limit.
//
// Threads  any thread may log. `write` is called under a lock, in the order of the lines.
#pragma once

#include <atomic>
#include <fmt/format.h>
#include <functional>
#include <memory>
#include <mutex>
#include <source_location>
#include <spdlog/common.h>
#include <string>
#include <type_traits>
#include <utility>

#include <mpf/clock.h>

#include "base/log_limiter.h"

namespace mpf {

// A format string and the source location of the statement that logs it.
template <class... Arguments>
struct LogFormat {
  template <class Text>
  consteval LogFormat(const Text& text,  // NOLINT(google-explicit-constructor): a string literal
                      std::source_location where = std::source_location::current())
      : format(text), at(where) {}
  fmt::format_string<Arguments...> format;
  std::source_location at;
};

class Log {
 public:
  using Level = spdlog::level::level_enum;
  using Write = std::function<void(Level, std::string)>;
  using Now = std::function<std::int64_t()>;  // [ns]

  explicit Log(Write write, Level least = Level::info, Now now = Clock::nowNs);

  // Returns a log with separate limits, for an object of the configuration.
  [[nodiscard]] Log forObject() const;

  template <class... Arguments>
  void debug(LogFormat<std::type_identity_t<Arguments>...> format, Arguments&&... arguments) const {
    say(Level::debug, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void info(LogFormat<std::type_identity_t<Arguments>...> format, Arguments&&... arguments) const {
    say(Level::info, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void warn(LogFormat<std::type_identity_t<Arguments>...> format, Arguments&&... arguments) const {
    say(Level::warn, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void error(LogFormat<std::type_identity_t<Arguments>...> format, Arguments&&... arguments) const {
    say(Level::err, format, std::forward<Arguments>(arguments)...);
  }
  template <class... Arguments>
  void critical(LogFormat<std::type_identity_t<Arguments>...> format,
                Arguments&&... arguments) const {
    say(Level::critical, format, std::forward<Arguments>(arguments)...);
  }

  //   name  one of ServerLog::levels()
  void setLevel(const std::string& name) const;

  // Sets a callback that receives the time at which writeDue() must be called, whenever it becomes
  // earlier. It runs under the lock and must not log.
  void onHeld(std::function<void(std::int64_t dueNs)> held) const;
  // Writes the held lines that are due. Returns the time of the next call; INT64_MAX: no line is
  // held.
  std::int64_t writeDue() const;
  // Writes all held lines. For the end of the program.
  void writeHeld() const;

 private:
  struct Core {
    std::mutex lock;
    std::atomic<Level> least;
    Write write;
    Now now;
    LogLimiter limiter;
    std::function<void(std::int64_t)> held;
    std::uint64_t lastObject = 0;
  };

  template <class... Arguments>
  void say(Level level, const LogFormat<std::type_identity_t<Arguments>...>& format,
           Arguments&&... arguments) const {
    if (level < core_->least.load(std::memory_order_relaxed)) return;
    sayText(level, format.at, fmt::format(format.format, std::forward<Arguments>(arguments)...));
  }
  void sayText(Level level, const std::source_location& at, std::string text) const;

  std::shared_ptr<Core> core_;
  std::uint64_t object_ = 0;
};

}  // namespace mpf
