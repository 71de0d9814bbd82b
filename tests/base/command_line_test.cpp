// SPDX-License-Identifier: MIT
// The command line of all programs: messages, where they are printed, and exit statuses.
#include "base/command_line.h"

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "base/version.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

struct Outcome {
  std::optional<int> status;
  std::string out;
  std::string err;
};

class CommandLine : public testing::Test {
 protected:
  CommandLine() {
    app_.add_option("--count", count_, "How many")->check(wholeNumber(1, 10));
    app_.add_option("--more", more_, "How many more")->check(wholeNumber(1));
    app_.add_option("--speed", speed_, "How fast")->check(number(0, 1.5));
  }
  Outcome parse(std::vector<const char*> words) { return parse(app_, std::move(words)); }
  static Outcome parse(CLI::App& app, std::vector<const char*> words) {
    words.insert(words.begin(), "/some/where/program");
    Outcome outcome;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    outcome.status = parseCommandLine(app, static_cast<int>(words.size()), words.data());
    outcome.err = testing::internal::GetCapturedStderr();
    outcome.out = testing::internal::GetCapturedStdout();
    return outcome;
  }
  CLI::App app_{"mpf-x - what it is for", "mpf-x"};
  std::uint32_t count_ = 0;
  std::uint64_t more_ = 0;
  double speed_ = 0;
};

TEST_F(CommandLine, AcceptsValidArgumentsWithoutOutput) {
  const auto outcome =
      parse({"--count", "10", "--more", "18446744073709551615", "--speed", "1e-3"});

  EXPECT_EQ(outcome.status, std::nullopt);
  EXPECT_EQ(count_, 10U);
  EXPECT_EQ(more_, ~std::uint64_t{0});
  EXPECT_EQ(speed_, 1e-3);
  EXPECT_THAT(outcome.out + outcome.err, IsEmpty());
}

// A time has a unit, or is in seconds. The help shows the default with its unit.
TEST_F(CommandLine, AcceptsTimes) {
  std::chrono::milliseconds pause{1500}, whole{250};
  addTime(app_, "--pause", pause, "How long", {.least = 1ms, .most = 1h});
  addTime(app_, "--whole", whole, "How much longer", kAboveZero);
  EXPECT_THAT(app_.help(), HasSubstr("--pause TIME=1500ms "));

  EXPECT_EQ(parse({"--pause", "0.2min", "--whole", "0.0001"}).status, std::nullopt);
  EXPECT_EQ(pause, 12s);
  EXPECT_EQ(whole, 1ms) << "rounded up";
  EXPECT_EQ(parse({"--pause", "2", "--whole", "300ms"}).status, std::nullopt);
  EXPECT_EQ(pause, 2s);
  EXPECT_EQ(whole, 300ms);

  for (const auto& [word, text] : std::vector<std::pair<const char*, std::string>>{
           {"soon",
            "soon is not a time: use 200ms, 2s or 1.5min; a number without a unit is in "
            "seconds;"},
           {"-1", "-1 is not a time: "},
           {"nan", "nan is not a time: "},
           {"1e300", "1e300 is not a time: "},
           {"0", "0 is out of range: use 1ms to 60min;"},
           {"61min", "61min is out of range: use 1ms to 60min;"}}) {
    const auto outcome = parse({"--pause", word});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, StartsWith("mpf-x: --pause: " + text));
  }
  EXPECT_THAT(parse({"--whole", "0"}).err, HasSubstr("0 is out of range: use more than 0s;"));
  EXPECT_EQ(whole, 300ms) << "unchanged";
}

TEST_F(CommandLine, PrintsHelpAndVersionToStdout) {
  const auto help = parse({"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.out, StartsWith("mpf-x - what it is for"));
  EXPECT_THAT(help.out, HasSubstr("--version"));
  EXPECT_THAT(help.err, IsEmpty());

  const auto version = parse({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out, std::string("mpf-x ") + kVersion + "\n");
  EXPECT_THAT(version.err, IsEmpty());
}

TEST_F(CommandLine, ReportsInvalidArgumentsOnStderrWithStatus2) {
  const std::vector<std::pair<std::vector<const char*>, std::string>> wrong{
      {{"--count", "0"}, "--count: 0 is out of range: use 1 to 10"},
      {{"--count", "-1"}, "--count: -1 is out of range: use 1 to 10"},
      {{"--count", "1.5"}, "--count: 1.5 is not a whole number: use 1 to 10"},
      {{"--count", "4294967297"}, "--count: 4294967297 is out of range: use 1 to 10"},
      {{"--more", "0"}, "--more: 0 is out of range: use 1 or more"},
      {{"--more", "18446744073709551616"},
       "--more: 18446744073709551616 is out of range: use 1 or more"},
      {{"--speed", "nan"}, "--speed: nan is out of range: use 0 to 1.5"},
      {{"--speed", "-0.1"}, "--speed: -0.1 is out of range: use 0 to 1.5"},
      {{"--speed", "fast"}, "--speed: fast is not a number: use 0 to 1.5"},
      {{"--cuont", "1"}, "The following arguments were not expected: --cuont 1"},
  };
  for (const auto& [words, why] : wrong) {
    const auto outcome = parse(words);

    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.err, "mpf-x: " + why + "; `mpf-x --help` shows how to use it\n");
    EXPECT_THAT(outcome.out, IsEmpty());
  }
}

TEST_F(CommandLine, NamesTheSubcommandInItsMessages) {
  CLI::App app("mpf-y - what it is for", "mpf-y");
  auto* const one = app.add_subcommand("one", "The first");
  one->add_option("--count", count_, "How many")->check(wholeNumber(1, 10));
  app.add_subcommand("two", "The second");
  app.require_subcommand(1);

  EXPECT_EQ(parse(app, {"one", "--count", "11"}).err,
            "mpf-y one: --count: 11 is out of range: use 1 to 10; `mpf-y one --help` shows how to "
            "use it\n");
  EXPECT_EQ(parse(app, {"three"}).err,
            "mpf-y: unknown subcommand or option \"three\"; the subcommands are one, two; `mpf-y "
            "--help` shows "
            "what they do\n");
  const auto nothing = parse(app, {});
  EXPECT_EQ(nothing.status, 2);
  EXPECT_THAT(nothing.err, StartsWith("mpf-y - what it is for"));
  EXPECT_THAT(nothing.out, IsEmpty());
}

}  // namespace
}  // namespace mpf::test
