// SPDX-License-Identifier: MIT
// mpf tap: shows the messages between a server and its clients, live, without taking part.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <fmt/format.h>
#include <memory>

#include <mpf/backplane.h>

#include "base/command_line.h"
#include "base/number.h"
#include "base/print_error.h"
#include "base/stop_signals.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/inspect/dissect.h"
#include "tools/tap/reader_watch.h"
#include "tools/tap/tap_session.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

struct TapArguments : ServerArguments {
  Nanoseconds duration{0};
  Nanoseconds poll = std::chrono::milliseconds(1);
  std::uint64_t count = 0;
  std::string link;
  std::string file;
  bool json = false;
  bool printAll = false;
};

constexpr int kShortPauses = 32;  // ratio of the longest pause to the shortest

// As hex() shows it.
std::string parseLink(const std::string& digits) {
  if (digits.empty()) return digits;
  const auto number = tryNumber<std::uint64_t>(digits, 16);
  if (number && hex(*number).size() >= kFewestDigits) return hex(*number);
  throw std::invalid_argument(
      fmt::format("\"{}\" is not a link: use its hexadecimal number, or at least its first {} "
                  "digits, as tap and inspect show it",
                  digits, kFewestDigits));
}

std::unique_ptr<TapSink> sinkFor(const TapArguments& arguments) {
  if (!arguments.file.empty()) return TapSink::file(arguments.file);
  if (arguments.json) return TapSink::json();
  return TapSink::lines(arguments.printAll ? SIZE_MAX : 16);
}

int tap(const TapArguments& arguments) {
  std::atomic<bool> stopped{false};
  const StopSignals stop(
      [](void* flag) noexcept { static_cast<std::atomic<bool>*>(flag)->store(true); }, &stopped);
  const ReaderWatch reader([&stopped] { stopped = true; });
  const auto link = parseLink(arguments.link);
  const auto sink = sinkFor(arguments);
  const auto location = chosenLocation(arguments.location);
  TapSession session({Backplane::named(arguments.backplane).name(), arguments.server, location,
                      link, arguments.count != 0 ? arguments.count : UINT64_MAX},
                     *sink);
  if (session.isServerThere()) {
    printError("mpf tap: \"{}\" has {} now\n", arguments.server, counted(session.links(), "link"));
  } else {
    printError("mpf tap: server \"{}\" at location {} is absent; waiting for it\n",
               arguments.server, location);
  }

  const auto end =
      arguments.duration > Nanoseconds(0) ? Deadline::after(arguments.duration) : Deadline::never();
  const auto isOver = [&] {
    return stopped || end.hasPassed() ||
           (arguments.count != 0 && session.seen() >= arguments.count);
  };
  auto pause = arguments.poll;
  while (!isOver()) {
    // More messages are likely to follow soon: the first pauses are short, later ones are longer.
    if (session.runOnce()) pause = arguments.poll / kShortPauses;
    else session.pause(pause = std::min(2 * pause, arguments.poll));
  }
  session.finish();
  sink->finish();
  for (const auto& problem : session.problems()) printError("mpf tap: {}\n", problem);
  printError("mpf tap: {} seen, {} missed\n", counted(session.seen(), "message"), session.missed());
  if (session.goneLinks() != 0)
    printError("mpf tap: {} ended before tap could read them\n",
               counted(session.goneLinks(), "link"));
  return session.problems().empty() ? 0 : 1;
}

}  // namespace

void addTap(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "tap", "Shows every message between a server and its clients, live, without taking part");
  auto arguments = std::make_shared<TapArguments>();
  addServer(command, *arguments);
  addTime(command, "seconds", arguments->duration, "Duration; 0: until Ctrl-C");
  command.add_option("--count", arguments->count, "End after this many messages; 0: no limit")
      ->capture_default_str()
      ->check(wholeNumber(0));
  command.add_option("--link", arguments->link,
                     "Only this link: its hexadecimal number, or at least its first 6 digits");
  auto* const write = command
                          .add_option("--write", arguments->file,
                                      "Write to this file, for `mpf replay`, instead of to stdout")
                          ->type_name("FILE");
  addTime(command, "--poll", arguments->poll,
          "Longest pause between two reads of links without new messages", kAboveZero);
  command.add_flag("--print", arguments->printAll, "Print arrays in full")->excludes(write);
  addJson(command, arguments->json);
  command.get_option("--json")->excludes(write);
  command.footer(
      "->: a request; <-: the reply that ends it; < : another message of the server. The number is "
      "the request's.\n"
      "Messages that arrived faster than tap could read are counted as missed. Only the owner of a "
      "link, its group and root may read it.");
  command.callback([arguments, &run] { run = [arguments] { return tap(*arguments); }; });
}

}  // namespace mpf::tools
