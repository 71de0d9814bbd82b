// SPDX-License-Identifier: MIT
// mpf call: sends a message of any type and prints the reply; or many, and prints how long they took.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include <mpf/base/duration_text.h>
#include <mpf/base/latency_recorder.h>
#include <mpf/base/stop_signals.h>
#include <mpf/client/sync_client.h>
#include <mpf/schema/json.h>
#include <mpf/tools/arguments.h>
#include <mpf/tools/commands.h>

namespace mpf::tools {
namespace {

struct CallArguments : ServerArguments {
  std::string type;
  std::vector<std::string> fields;
  std::uint64_t count = 1;
  double timeout = 1;   // [s]
  double interval = 0;  // [s]
  double follow = 0;    // [s]
  bool json = false;
  bool printAll = false;
};

Nanoseconds seconds(double s) { return Nanoseconds(static_cast<std::int64_t>(s * 1e9)); }

class Caller {
 public:
  Caller(const CallArguments& arguments, MessageType type)
      : arguments_(arguments),
        type_(type),
        client_(Backplane::attach(arguments.backplane), arguments.server, arguments.location),
        stop_([](void* stopped) noexcept { static_cast<std::atomic<bool>*>(stopped)->store(true); }, &stopped_) {}

  int run() {
    for (std::uint64_t i = 0; i < arguments_.count && !stopped_; ++i) {
      if (i != 0 && arguments_.interval > 0) std::this_thread::sleep_for(seconds(arguments_.interval));
      callOnce();
      showProgress(i + 1);
    }
    follow();
    report();
    return failed_ == 0 && recorder_->count() != 0 ? 0 : 1;
  }

 private:
  [[nodiscard]] bool isLoop() const noexcept { return arguments_.count > 1; }
  [[nodiscard]] bool showsEach() const noexcept { return !isLoop() || arguments_.printAll; }

  void callOnce() {
    std::string error;  // parsed before: nothing is wrong with it
    auto message = tryParse(type_, arguments_.fields, error);
    const auto sentNs = Clock::nowNs();
    auto answer = client_.call(std::move(*message), seconds(arguments_.timeout));
    if (answer) {
      recorder_->add(static_cast<std::uint64_t>(Clock::nowNs() - sentNs));
      if (showsEach()) show(answer.message());
    } else {
      ++failed_;
      const auto because = client_.client().notConnectedBecause();
      const auto why = answer.why() + (because.empty() ? "" : ": " + because);
      ++reasons_[why];
      if (showsEach() && !arguments_.json) fmt::print(stderr, "mpf call: {}\n", why);
    }
  }

  void show(const Message& message) {
    if (arguments_.json) replies_.push_back(toJson(message));
    else fmt::print("{}\n", print(message, arguments_.printAll ? std::numeric_limits<std::size_t>::max() : 64));
    std::fflush(stdout);  // a reader in a pipe wants it now
  }

  // Messages of the server that come after the reply.
  void follow() {
    const auto until = Deadline::after(seconds(arguments_.follow));
    while (arguments_.follow > 0 && !stopped_) {
      const auto message = client_.receive(until.left());
      if (!message) return;
      show(message);
    }
  }

  void showProgress(std::uint64_t done) {
    const auto nowNs = Clock::nowNs();
    if (!isLoop() || nowNs - shownNs_ < 1'000'000'000 || ::isatty(STDERR_FILENO) == 0) return;
    shownNs_ = nowNs;
    fmt::print(stderr, "\r{} of {}, {} failed ", done, arguments_.count, failed_);
  }

  void report() {
    if (shownNs_ != 0) fmt::print(stderr, "\r\x1b[K");
    if (arguments_.json) return reportJson();
    if (!isLoop()) return;
    for (const auto& [reason, times] : reasons_) {
      if (!showsEach()) fmt::print(stderr, "mpf call: {}{}\n", reason, times == 1 ? "" : fmt::format(" ({} times)", times));
    }
    const auto at = [&](double percent) { return durationText(static_cast<double>(recorder_->percentileNs(percent))); };
    fmt::print("{} replied, {} did not; p50 {}, p99 {}, p99.9 {}, max {}\n", recorder_->count(), failed_, at(50), at(99), at(99.9),
               durationText(static_cast<double>(recorder_->maxNs())));
  }

  void reportJson() {
    nlohmann::json json{{"server", arguments_.server},
                        {"location", arguments_.location},
                        {"replied", recorder_->count()},
                        {"failed", failed_},
                        {"why", reasons_},
                        {"replies", replies_},
                        {"p50_ns", recorder_->percentileNs(50)},
                        {"p99_ns", recorder_->percentileNs(99)},
                        {"p999_ns", recorder_->percentileNs(99.9)},
                        {"max_ns", recorder_->maxNs()}};
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  }

  const CallArguments& arguments_;
  MessageType type_;
  SyncClient client_;
  std::atomic<bool> stopped_{false};
  StopSignals stop_;
  std::unique_ptr<LatencyRecorder> recorder_ = std::make_unique<LatencyRecorder>();
  std::uint64_t failed_ = 0;
  std::map<std::string, std::uint64_t> reasons_;
  nlohmann::json replies_ = nlohmann::json::array();
  std::int64_t shownNs_ = 0;
};

int call(const CallArguments& arguments) {
  const auto type = tryParseType(arguments.type);
  if (!type) {
    fmt::print(stderr, "mpf call: no message type \"{}\"; there are {}\n", arguments.type, typeNames());
    return 2;
  }
  std::string error;
  if (!tryParse(*type, arguments.fields, error)) {
    fmt::print(stderr, "mpf call: {}\n", error);
    return 2;
  }
  return Caller(arguments, *type).run();
}

}  // namespace

void addCall(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("call", "Sends a message to a server and prints the reply; or many, and how long they took");
  auto arguments = std::make_shared<CallArguments>();
  addServer(command, *arguments);
  command.add_option("type", arguments->type, "Type of the message: " + typeNames())->required();
  command.add_option("fields", arguments->fields, "Its fields, as field=value: value=3, value=1,2,3, value='*IDN?\\n', eomString='\\r\\n'");
  command.add_option("--timeout", arguments->timeout, "Longest wait for a reply [s]")->capture_default_str()->check(CLI::PositiveNumber);
  command.add_option("--count", arguments->count, "Messages to send, one after the other's reply")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 53));
  command.add_option("--interval", arguments->interval, "Pause between them [s]")->capture_default_str()->check(CLI::NonNegativeNumber);
  command.add_option("--follow", arguments->follow, "Go on printing what the server sends after the reply [s]")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--print", arguments->printAll, "Print each reply of a loop, and arrays in full");
  addJson(command, arguments->json);
  command.callback([arguments, &run] { run = [arguments] { return call(*arguments); }; });
}

}  // namespace mpf::tools
