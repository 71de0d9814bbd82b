// SPDX-License-Identifier: MIT
// CommandLine: what all programs do alike with their arguments. --help and --version end them with
// 0; wrong arguments with 2, and a sentence that names the program, what is wrong, and where one
// can read how it is right.
//
//   CLI::App app("mpf-x - what it is for", "mpf-x");
//   app.add_option("--count", count, "How many")->check(wholeNumber(1, 1000));
//   if (const auto status = parseCommandLine(app, argc, argv)) return *status;
//
// Threads  one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11's
class App;
class Validator;
}  // namespace CLI

namespace mpf {

// Adds --version, and fills what `app` knows from the arguments. The exit status, when the program
// shall end.
[[nodiscard]] std::optional<int> parseCommandLine(CLI::App& app, int argc, const char* const* argv);

// Says what is wrong with the arguments of `program`: "mpf-x: WHY; `mpf-x --help` shows how to use
// it". Returns the exit status, 2.
int refuseArguments(const std::string& program, const std::string& why);

// Checks of a value: "0 is out of range: use 1 to 1000", or "use 1 or more".
[[nodiscard]] CLI::Validator wholeNumber(std::uint64_t least,
                                         std::uint64_t most = ~std::uint64_t{0});
[[nodiscard]] CLI::Validator number(double least, double most);

}  // namespace mpf
