// SPDX-License-Identifier: MIT
#include "benchmarks/local/session.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

#include "base/number.h"
#include "base/output_file.h"
#include "base/print_error.h"
#include "benchmarks/local/report.h"
#include "benchmarks/local/runner.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

bool isWanted(const Measurement& row, const std::vector<std::string>& only) {
  return only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& part) {
           return (row.question + ": " + row.name + ", " + toString(row.mode)).find(part) !=
                  std::string::npos;
         });
}

Budget budgetOf(const Measurement& row, const std::vector<Measurement>& rows, const Pace& pace,
                bool quick) {
  auto whole = pace.fullRow;
  if (quick) {
    const auto shares =
        std::accumulate(rows.begin(), rows.end(), 0.0, [](double sum, const Measurement& each) {
          return sum + (each.skipped.empty() ? each.share : 0);
        });
    whole = std::min<Nanoseconds>(whole, pace.quickRun / std::max(1, static_cast<int>(shares)));
  }
  const auto mine = std::chrono::duration_cast<Nanoseconds>(whole * row.share);
  return {mine / 5, mine - mine / 5};
}

using Row = std::vector<Measurement>::const_iterator;

Row endOfBlock(Row begin, Row all, const Pace& pace) {
  if (!pace.sharesFloors) return begin + 1;
  return std::find_if(begin, all, [&](const Measurement& row) {
    return row.setting != begin->setting || row.question != begin->question;
  });
}

// Parses "0+2"; empty when the text is something else.
Cpus parseCpus(const std::string& text) {
  Cpus cpus;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, '+');) {
    const auto cpu = tryNumber<int>(word);
    if (!cpu || *cpu < 0) return {};
    cpus.push_back(*cpu);
  }
  return cpus;
}

// Opens the JSON file before the work, which takes minutes; nullopt without a file name.
std::optional<OutputFile> openJson(const Options& options) {
  if (options.jsonFile.empty() || options.jsonFile == "-") return std::nullopt;
  return OutputFile(options.jsonFile);
}

void listRows(const std::vector<Measurement>& rows) {
  for (const auto& row : rows)
    fmt::print("{}: {}, {}{}\n", row.question, row.name, toString(row.mode),
               row.skipped.empty() ? "" : " (left out: " + row.skipped + ")");
}

int show(const std::vector<Result>& results, const Machine& machine, const Placement& placement,
         const Options& options, const std::string& table, std::optional<OutputFile> jsonFile) {
  const auto json = toJson(results, machine, placement);
  if (options.jsonFile == "-") {
    fmt::print("{}", json);
  } else {
    fmt::print("{}\n{}\n{}", machine.text(), options.commandLine, table);
  }
  if (jsonFile) {
    jsonFile->write(json);
    jsonFile->close();
  }
  return std::any_of(results.begin(), results.end(),
                     [](const Result& result) { return !result.error.empty(); })
             ? 1
             : 0;
}

}  // namespace

void addOptions(CLI::App& app, Options& options) {
  app.add_flag(
      "--quick", options.quick,
      "Measure for a shorter time, with more noise: 90 s (local) or 40 s (others) at most");
  app.add_flag("--list", options.list, "Only list the rows that would be measured");
  app.add_option(
      "--json", options.jsonFile,
      "Write the results to this file, as a list of objects; -: to stdout instead of the table");
  app.add_option("--cpus", options.cpus,
                 "CPUs of the server and of the requester, as 0,1 or 0+2,1+3; default: the first "
                 "two")
      ->delimiter(',')
      ->expected(2);
  app.add_option(
      "--only", options.only,
      "Measure only rows whose name contains one of these, and the floors that they need");
}

CLI::Option* addWaitOption(CLI::App& app, Mode& wait) {
  static const std::map<std::string, Mode> modes{
      {"adaptive", Mode::adaptive}, {"block", Mode::block}, {"spin", Mode::spin}};
  return app
      .add_option_function<std::string>(
          "--wait", [&wait](const std::string& name) { wait = modes.at(name); },
          "How MPF servers and clients wait")
      ->check(CLI::IsMember({"adaptive", "block", "spin"}))
      ->default_str("adaptive");
}

std::vector<Measurement> choose(std::vector<Measurement> all, const Options& options) {
  std::set<std::tuple<std::string, std::string, std::size_t>> floors;
  for (const auto& row : all) {
    if (isWanted(row, options.only)) floors.emplace(row.setting, row.floorName, row.floorBytes);
  }
  std::erase_if(all, [&](const Measurement& row) {
    return !isWanted(row, options.only) && !floors.contains({row.setting, row.name, row.bytes});
  });
  return all;
}

std::optional<Placement> place(const Options& options, bool mayShare) {
  if (options.list) return Placement{};
  const auto allowed = allowedCpus();
  Placement placement{{allowed.front()}, {allowed.back()}};
  if (allowed.size() > 1) placement.requester = {allowed[1]};
  if (!options.cpus.empty())
    placement = {parseCpus(options.cpus.front()), parseCpus(options.cpus.back())};
  for (const auto& side : {placement.server, placement.requester}) {
    if (side.empty()) {
      printError("bench: --cpus: use a CPU number for each side, or several as 0+2\n");
      return std::nullopt;
    }
    for (const auto cpu : side) {
      if (std::find(allowed.begin(), allowed.end(), cpu) != allowed.end()) continue;
      printError("bench: this process may not use CPU {}\n", cpu);
      return std::nullopt;
    }
  }
  if (placement.server == placement.requester && !mayShare) {
    printError(
        "bench: server and requester need different CPUs, this process may use {}; see --cpus\n",
        allowed.size());
    return std::nullopt;
  }
  return placement;
}

std::vector<Result> takeAll(const std::vector<Measurement>& rows, const Placement& placement,
                            const Options& options, const Pace& pace) {
  Runner runner(placement, rows, pace.line ? &*pace.line : nullptr);
  std::vector<Result> results;
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = endOfBlock(begin, rows.end(), pace);
    std::vector<PlannedRow> block;
    for (auto row = begin; row != end; ++row)
      block.push_back({*row, budgetOf(*row, rows, pace, options.quick), pace.rounds(*row)});
    for (auto& result : runner.run(std::move(block))) {
      results.push_back(std::move(result));
      printError("{:3}% {}\n", results.size() * 100 / rows.size(), oneLine(results.back()));
    }
    begin = end;
  }
  return results;
}

int run(std::vector<Measurement> all, const std::optional<Placement>& placement,
        const Options& options, const Pace& pace,
        const std::function<std::string(const std::vector<Result>&)>& tableOf) {
  const auto rows = choose(std::move(all), options);
  if (options.list) {
    listRows(rows);
    return 0;
  }
  if (!placement) return 2;
  if (rows.empty()) {
    printError("bench: --only: no row has such a name; --list shows all names\n");
    return 2;
  }
  const auto machine = Machine::look(*placement);
  auto jsonFile = openJson(options);
  removeBackplanes(kRunPrefix);  // of runs that were interrupted
  const auto results = takeAll(rows, *placement, options, pace);
  return show(results, machine, *placement, options, tableOf(results), std::move(jsonFile));
}

}  // namespace mpf::bench
