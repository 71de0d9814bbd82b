// SPDX-License-Identifier: MIT
#include <mpf/benchmarks/local.h>

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <fstream>
#include <numeric>
#include <optional>
#include <set>

#include <mpf/benchmarks/mpf_peer.h>
#include <mpf/benchmarks/report.h>
#include <mpf/benchmarks/runner.h>

namespace mpf::bench {
namespace {

constexpr auto kQuickRun = std::chrono::seconds(12);  // of warm-up and measurement together; the rest is setting up
constexpr auto kFullRow = std::chrono::milliseconds(400);

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

bool isWanted(const Measurement& row, const std::vector<std::string>& only) {
  return only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& part) {
           return contains(row.question + ": " + row.name + ", " + toString(row.mode), part);
         });
}

// What was asked for, and the floors that it is divided by.
std::vector<Measurement> choose(const LocalOptions& options) {
  auto all = catalogue(kRunPrefix + std::to_string(::getpid()));
  std::set<std::pair<std::string, std::size_t>> floors;
  for (const auto& row : all) {
    if (isWanted(row, options.only)) floors.emplace(row.floorName, row.floorBytes);
  }
  std::erase_if(all, [&](const Measurement& row) { return !isWanted(row, options.only) && !floors.contains({row.name, row.bytes}); });
  return all;
}

Budget budgetOf(const Measurement& row, const std::vector<Measurement>& rows, bool quick) {
  Nanoseconds whole = kFullRow;
  if (quick) {
    const auto shares = std::accumulate(rows.begin(), rows.end(), 0.0,
                                        [](double sum, const Measurement& each) { return sum + (each.skipped.empty() ? each.share : 0); });
    whole = std::min<Nanoseconds>(whole, std::chrono::duration_cast<Nanoseconds>(kQuickRun) / std::max(1, static_cast<int>(shares)));
  }
  const auto mine = std::chrono::duration_cast<Nanoseconds>(whole * row.share);
  return {mine / 5, mine - mine / 5};
}

std::optional<Placement> place(const LocalOptions& options) {
  const auto allowed = allowedCpus();
  const auto& wanted = options.cpus.empty() ? allowed : options.cpus;
  const auto isAllowed = [&](int cpu) { return std::find(allowed.begin(), allowed.end(), cpu) != allowed.end(); };
  if (wanted.size() < 2 || wanted[0] == wanted[1]) {
    fmt::print(stderr, "bench: two CPUs are needed, this process may use {}\n", allowed.size());
    return std::nullopt;
  }
  if (!isAllowed(wanted[0]) || !isAllowed(wanted[1])) {
    fmt::print(stderr, "bench: this process may not use CPU {}\n", isAllowed(wanted[0]) ? wanted[1] : wanted[0]);
    return std::nullopt;
  }
  return Placement{wanted[0], wanted[1]};
}

// Every row of a full run has a floor beside it; of a quick one ours have.
int roundsOf(const Measurement& row, bool quick) {
  if (row.floorName.empty()) return 0;
  if (quick) return row.name.starts_with(kMpf) ? 1 : 0;
  return row.isSlow ? 1 : 3;
}

int listRows(const std::vector<Measurement>& rows) {
  for (const auto& row : rows)
    fmt::print("{}: {}, {}{}\n", row.question, row.name, toString(row.mode), row.skipped.empty() ? "" : " (left out: " + row.skipped + ")");
  return 0;
}

bool writeFile(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) fmt::print(stderr, "bench: cannot write {}\n", path);
  return static_cast<bool>(file);
}

}  // namespace

void addOptions(CLI::App& app, LocalOptions& options) {
  app.add_flag("--quick", options.quick, "End within 40 s: shorter, and so noisier, measurements");
  app.add_flag("--list", options.list, "Only name what would be measured");
  app.add_option("--json", options.jsonFile, "Write the results there, as a list of objects; - for stdout in place of the table");
  app.add_option("--cpus", options.cpus, "CPUs of server and requester; default: the first two that this process may use")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--only", options.only, "Measure only rows whose name contains one of these, and the floors that they need");
}

int runLocal(const LocalOptions& options) {
  const auto rows = choose(options);
  if (options.list) return listRows(rows);
  const auto placement = place(options);
  if (!placement) return 2;
  if (rows.empty()) {
    fmt::print(stderr, "bench: nothing has such a name; --list shows the names\n");
    return 2;
  }
  const auto machine = Machine::look(*placement);
  removeBackplanes(kRunPrefix);  // of runs that were interrupted

  Runner runner(*placement, rows);
  std::vector<Result> results;
  for (const auto& row : rows) {
    results.push_back(runner.run(row, budgetOf(row, rows, options.quick), roundsOf(row, options.quick)));
    fmt::print(stderr, "{:3}% {}\n", results.size() * 100 / rows.size(), oneLine(results.back()));
  }

  const auto json = toJson(results, machine, *placement);
  if (options.jsonFile == "-") {
    fmt::print("{}", json);
  } else {
    fmt::print("{}\n{}\n{}{}", machine.text(), options.commandLine, table(results), goals(results));
    if (!options.jsonFile.empty() && !writeFile(options.jsonFile, json)) return 1;
  }
  return std::any_of(results.begin(), results.end(), [](const Result& result) { return !result.error.empty(); }) ? 1 : 0;
}

}  // namespace mpf::bench
