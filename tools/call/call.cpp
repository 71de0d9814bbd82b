// SPDX-License-Identifier: MIT
// mpf call: sends a message of any type and prints the reply; or sends many and prints statistics
// of the round-trip times.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include <mpf/sync_client.h>

#include "base/command_line.h"
#include "base/duration_text.h"
#include "base/latency_recorder.h"
#include "base/print_error.h"
#include "base/stop_signals.h"
#include "schema/json.h"
#include "tools/arguments.h"
#include "tools/call/unreachable.h"
#include "tools/commands.h"
#include "tools/text/json_text.h"
#include "tools/text/show.h"

namespace mpf::tools {
namespace {

struct CallArguments : ServerArguments {
  std::string type;
  std::vector<std::string> fields;
  std::uint64_t count = 1;
  Nanoseconds timeout = std::chrono::seconds(1);
  Nanoseconds interval{0};
  Nanoseconds follow{0};
  bool json = false;
  bool printAll = false;
};

// Whether a user may send messages of this type. MPF itself sends the others to clients: no server
// has a handler for them, and a reply of such a type would look like the fate of a request.
bool isForCalls(MessageType type) {
  return type != MessageType::connect && type != MessageType::requestFate;
}

std::string typesForCalls() {
  std::string names;
  for (std::uint16_t number = 1; toString(static_cast<MessageType>(number)) != "unknown";
       ++number) {
    const auto type = static_cast<MessageType>(number);
    if (isForCalls(type)) names.append(names.empty() ? "" : ", ").append(toString(type));
  }
  return names;
}

class Caller {
 public:
  Caller(const CallArguments& arguments, MessageType type)
      : arguments_(arguments),
        type_(type),
        location_(chosenLocation(arguments.location)),
        client_(Backplane::attach(arguments.backplane), arguments.server, location_) {
    // A loop prints statistics at its end, and so a signal only ends the loop, after the call that
    // is in progress. For a single call a signal ends the program.
    if (isLoop() || arguments_.follow > Nanoseconds(0)) {
      stop_.emplace(
          [](void* stopped) noexcept { static_cast<std::atomic<bool>*>(stopped)->store(true); },
          &stopped_);
    }
  }

  int run() {
    for (std::uint64_t i = 0; i < arguments_.count && !stopped_; ++i) {
      if (i != 0) pause();
      if (stopped_) break;
      callOnce();
      showProgress(i + 1);
    }
    follow();
    report();
    return failed_ == 0 && recorder_->count() != 0 ? 0 : 1;
  }

 private:
  // How often a wait checks whether a signal has stopped the program.
  static constexpr Nanoseconds kStopCheckInterval = std::chrono::milliseconds(100);

  [[nodiscard]] bool isLoop() const noexcept { return arguments_.count > 1; }
  [[nodiscard]] bool showsEach() const noexcept { return !isLoop() || arguments_.printAll; }

  void pause() const {
    const auto until = Deadline::after(arguments_.interval);
    while (!stopped_ && !until.hasPassed())
      std::this_thread::sleep_for(std::min(kStopCheckInterval, until.left()));
  }

  void callOnce() {
    std::string error;
    auto message = tryParse(type_, arguments_.fields, error);
    if (!message) throw std::logic_error(error);  // cannot happen: call() has parsed it before
    const auto sentNs = Clock::nowNs();
    auto answer = client_.call(std::move(*message), arguments_.timeout);
    if (answer) {
      recorder_->add(static_cast<std::uint64_t>(Clock::nowNs() - sentNs));
      if (showsEach()) show(answer.message());
    } else {
      ++failed_;
      const auto why = whyNot(answer);
      ++reasons_[why];
      if (showsEach() && !arguments_.json) printError("mpf call: {}\n", why);
    }
  }

  [[nodiscard]] std::string whyNot(const Answer& answer) const {
    const auto why = answer.why();
    if (answer.refusal() != SendResult::notConnected) return why;
    const auto snapshot = Snapshot::take(Backplane::named(arguments_.backplane).name());
    return why + connectionHint(snapshot, arguments_.server, location_) +
           "; `mpf ls` shows all servers";
  }

  void show(const Message& message) {
    if (arguments_.json) replies_.push_back(toJson(message));
    else
      tools::show(
          print(message, arguments_.printAll ? std::numeric_limits<std::size_t>::max() : 64) +
          "\n");
  }

  // Prints the messages that the server sends after the reply.
  void follow() {
    const auto until = Deadline::after(arguments_.follow);
    while (arguments_.follow > Nanoseconds(0) && !stopped_ && !until.hasPassed()) {
      const auto wait = std::min(kStopCheckInterval, until.left());
      if (const auto message = client_.receive(wait)) show(message);
    }
  }

  void showProgress(std::uint64_t done) {
    const auto nowNs = Clock::nowNs();
    if (!isLoop() || nowNs - shownNs_ < 1'000'000'000 || ::isatty(STDERR_FILENO) == 0) return;
    shownNs_ = nowNs;
    writeError(fmt::format("\r{} of {}, {} failed ", done, arguments_.count, failed_));
  }

  void report() {
    if (shownNs_ != 0) writeError("\r\x1b[K");
    if (arguments_.json) return reportJson();
    if (!isLoop()) return;
    for (const auto& [reason, times] : reasons_) {
      if (!showsEach())
        printError("mpf call: {}{}\n", reason, times == 1 ? "" : fmt::format(" ({} times)", times));
    }
    const auto at = [&](double percent) {
      return durationText(static_cast<double>(recorder_->percentileNs(percent)));
    };
    fmt::print("{} replied, {} did not; p50 {}, p99 {}, p99.9 {}, max {}\n", recorder_->count(),
               failed_, at(50), at(99), at(99.9),
               durationText(static_cast<double>(recorder_->maxNs())));
  }

  void reportJson() {
    nlohmann::json report{{"server", arguments_.server},
                          {"location", location_},
                          {"replied", recorder_->count()},
                          {"failed", failed_},
                          {"why", reasons_},
                          {"replies", replies_},
                          {"p50_ns", recorder_->percentileNs(50)},
                          {"p99_ns", recorder_->percentileNs(99)},
                          {"p999_ns", recorder_->percentileNs(99.9)},
                          {"max_ns", recorder_->maxNs()}};
    fmt::print("{}\n", jsonText(report));
  }

  const CallArguments& arguments_;
  MessageType type_;
  std::int32_t location_;
  SyncClient client_;
  std::atomic<bool> stopped_{false};
  std::optional<StopSignals> stop_;
  std::unique_ptr<LatencyRecorder> recorder_ = std::make_unique<LatencyRecorder>();
  std::uint64_t failed_ = 0;
  std::map<std::string, std::uint64_t> reasons_;
  nlohmann::json replies_ = nlohmann::json::array();
  std::int64_t shownNs_ = 0;
};

int call(const CallArguments& arguments) {
  const auto type = tryParseType(arguments.type);
  if (!type || !isForCalls(*type)) {
    const auto what =
        type ? "is a message type that only MPF itself sends" : "is not a message type";
    printError("mpf call: {} {}; use one of {}\n", arguments.type, what, typesForCalls());
    return 2;
  }
  std::string error;
  if (!tryParse(*type, arguments.fields, error)) {
    printError("mpf call: {}\n", error);
    return 2;
  }
  return Caller(arguments, *type).run();
}

}  // namespace

void addCall(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "call", "Sends a message to a server and prints the reply; or sends many and prints times");
  auto arguments = std::make_shared<CallArguments>();
  addServer(command, *arguments);
  command.add_option("type", arguments->type, "Type of the message: " + typesForCalls())
      ->required();
  command.add_option(
      "fields", arguments->fields,
      R"(Its fields, as field=value: value=3, value=1,2,3, value='*IDN?\n', eomString='\r\n')");
  addTime(command, "--timeout", arguments->timeout, "Longest wait for a reply", kAboveZero);
  command.add_option("--count", arguments->count, "Messages to send, each after a reply")
      ->capture_default_str()
      ->check(wholeNumber(1, std::uint64_t{1} << 53));
  addTime(command, "--interval", arguments->interval, "Pause between them");
  addTime(command, "--follow", arguments->follow,
          "Time to print further messages that the server sends after the reply");
  command.add_flag("--print", arguments->printAll,
                   "With --count: print each reply; print arrays in full");
  addJson(command, arguments->json);
  command.footer(
      "Fields that are not named are 0. The message about an unknown field lists all fields.\n"
      "Example: mpf call Int32 int32 value=3\n"
      "Example: mpf call voltmeter char8Array cmd=3 timeout=1 value='*IDN?\\n' --timeout 5    (a "
      "serial server: write, then read; the instrument has 1 s)\n"
      "Exit status: 0 every message got a reply (even one that reports an error); 1 a message got "
      "no reply; 2 usage error, unknown type or field.");
  command.callback([arguments, &run] { run = [arguments] { return call(*arguments); }; });
}

}  // namespace mpf::tools
