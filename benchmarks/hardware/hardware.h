// SPDX-License-Identifier: MIT
// `mpf bench hardware`: measures servers over models of Industry Pack modules beside the echo
// server, the cost of scanning, and eight serial ports beside the manual's table ("octalSerialPort
// performance").
//
//   mpf-dac128v-server --carrier ipac=model ...  ─┐
//   mpf-int32-server, the echo                   ─┴─ backplane ─ client
//   server's CPUs                                              requester's CPUs
//
// Threads  as in session.h.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "benchmarks/local/session.h"
#include "benchmarks/stage/program.h"

namespace mpf::bench {

inline constexpr const char* kHardwareHelp =
    "Measures servers over models of Industry Pack modules, beside the echo server and beside the "
    "manual's table of serial ports";

struct HardwareOptions : Options {
  Mode wait = Mode::adaptive;  // of servers and clients
};

// Adds --wait to the usual ones; spin is refused.
void addOptions(CLI::App& app, HardwareOptions& options);

// Returns the exit status of the program: 0 all rows were measured or left out with a reason, 1 a
// row failed, 2 usage error.
[[nodiscard]] int runHardware(const HardwareOptions& options);

// The backplane and the CPUs of the rows.
struct Bench {
  std::string backplane;  // unique on this host
  Placement placement;
  Mode wait = Mode::adaptive;
};

// The server programs that some rows need, on the server's CPUs; the echo server is always one of
// them, so that it can be measured right before each row.
class HardwareServers {
 public:
  //   words  name and arguments of the measured program; empty: only the echo server runs
  HardwareServers(Bench bench, std::vector<std::string> words);
  ~HardwareServers() { stop(); }
  HardwareServers(const HardwareServers&) = delete;
  HardwareServers& operator=(const HardwareServers&) = delete;

  void start();
  void stop() noexcept;
  [[nodiscard]] const Bench& bench() const noexcept { return bench_; }
  // Empty, or which program is missing.
  [[nodiscard]] std::string missing() const;
  // Of the measured program.
  [[nodiscard]] int pid() const noexcept { return measured_.pid(); }
  [[nodiscard]] std::string said() const { return measured_.said(); }
  // Runs `row`. Adds the last output of the measured program to an error. When that program has
  // ended before, `row` is not run.
  [[nodiscard]] Outcome run(const std::function<Outcome()>& row);

 private:
  void launch(Program& program, std::vector<std::string> words);
  Bench bench_;
  std::vector<std::string> words_;
  Program echo_, measured_;
};

// The rows of one source file each.
[[nodiscard]] std::vector<Measurement> roundTripRows(const Bench& bench);
[[nodiscard]] std::vector<Measurement> scanRows(const Bench& bench);
[[nodiscard]] std::vector<Measurement> serialRows(const Bench& bench);

// A row that runs with these servers. Rows that share them have the same `environment`.
[[nodiscard]] Measurement rowOf(const std::shared_ptr<HardwareServers>& servers,
                                const std::string& environment, const std::string& question,
                                const std::string& name);

// The arguments of an mpf-serial-server with eight ports of a model, served as "port0" to "port7".
//   takesTime  characters take as long as on a real line
[[nodiscard]] std::vector<std::string> eightPorts(bool takesTime);

[[nodiscard]] std::string hardwareTable(const std::vector<Result>& results);

// Headings, and names that the table looks for.
inline constexpr const char* kServers = "Round trips with a server over a model";
inline constexpr const char* kScanning =
    "An IP330 that scans 32 channels at 1 kHz, its model in real time: one scan server, no client "
    "asks";
inline constexpr const char* kSerial =
    "100 characters to each of eight serial ports at 38400 baud (manual, \"octalSerialPort "
    "performance\")";
// Unit of a row about incomplete answers.
inline constexpr const char* kShortAnswers = "answers";
inline constexpr const char* kEcho = "mpf-int32-server, the echo";
inline constexpr const char* kManualLocal = "the manual's, local";
inline constexpr const char* kManualRemote = "the manual's, remote";
// Measurement::detail of a number that is only for comparison.
inline constexpr const char* kNotMeasured = "not measured here";

}  // namespace mpf::bench
