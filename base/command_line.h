// SPDX-License-Identifier: MIT
// CommandLine: parses the arguments of every program in the same way. --help and --version end the
// program with status 0. A usage error ends it with status 2 and a message that names the program,
// the error and the --help option.
//
//   CLI::App app("mpf-x - what it is for", "mpf-x");
//   app.add_option("--count", count, "How many")->check(wholeNumber(1, 1000));
//   if (const auto status = parseCommandLine(app, argc, argv)) return *status;
//
// Threads  one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "base/time_text.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
class Option;
class Validator;
}  // namespace CLI

namespace mpf {

// Adds --version to `app` and parses the arguments into its options. Returns the exit status if
// the program must exit now, nullopt if it must continue.
[[nodiscard]] std::optional<int> parseCommandLine(CLI::App& app, int argc, const char* const* argv);

// Prints a usage error of `program` to stderr: "mpf-x: WHY; `mpf-x --help` shows how to use it".
// Returns the exit status, 2.
int refuseArguments(const std::string& program, const std::string& why);

// Validators of an option's value. Their message: "0 is out of range: use 1 to 1000", "0 is out of
// range: use 1 or more", or "abc is not a whole number: use 1 to 1000".
[[nodiscard]] CLI::Validator wholeNumber(std::uint64_t least,
                                         std::uint64_t most = ~std::uint64_t{0});
[[nodiscard]] CLI::Validator number(double least, double most);

struct TimeRange {
  Nanoseconds least{0};
  Nanoseconds most = kLongestTime;
};
inline constexpr TimeRange kAboveZero{.least = Nanoseconds(1)};

// Adds an option for a time, as in "200ms", "2s", "1.5min" or "2", which means seconds. The help
// shows the present value of `time` as the default. Fractions of the unit of `time` are rounded up.
CLI::Option* addTime(CLI::App& app, const std::string& name, Nanoseconds present,
                     const std::string& help, TimeRange range,
                     const std::function<void(Nanoseconds)>& set);
template <class Rep, class Period>
CLI::Option* addTime(CLI::App& app, const std::string& name,
                     std::chrono::duration<Rep, Period>& time, const std::string& help,
                     TimeRange range = {}) {
  using Time = std::chrono::duration<Rep, Period>;
  return addTime(app, name, time, help, range,
                 [&time](Nanoseconds value) { time = std::chrono::ceil<Time>(value); });
}

}  // namespace mpf
