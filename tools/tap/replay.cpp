// SPDX-License-Identifier: MIT
// mpf replay: sends the requests of a recording to a server, with the timing that they had; or
// replies to requests as the recorded server did.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include <mpf/message_client.h>

#include "base/command_line.h"
#include "base/duration_text.h"
#include "base/latency_recorder.h"
#include "base/print_error.h"
#include "base/saturating.h"
#include "base/stop_signals.h"
#include "schema/conversion.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/tap/ghost.h"
#include "tools/tap/pace.h"
#include "tools/tap/recording.h"
#include "tools/text/json_text.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

struct ReplayArguments {
  std::string file;
  std::string backplane;
  std::string server;
  std::optional<std::int32_t> location;
  double speed = 1;  // 0: as fast as the server accepts them
  Nanoseconds timeout = std::chrono::seconds(10);
  bool json = false;
  bool asServer = false;
};

// One client for each client of the recording, so that the requests of each stay in their order.
class Replayer {
 public:
  explicit Replayer(const ReplayArguments& arguments)
      : arguments_(arguments),
        location_(chosenLocation(arguments.location)),
        dispatcher_(Backplane::attach(arguments.backplane)),
        stop_([](void* self) noexcept { static_cast<Replayer*>(self)->stop(); }, this) {}

  int run() {
    send();
    if (requests_ == 0 && problem_.empty() && !stopped_)
      problem_ = arguments_.file + ": no request in it";
    awaitRest();
    report();
    return problem_.empty() && replied_ == requests_ ? 0 : 1;
  }

 private:
  static constexpr Nanoseconds kRetry = std::chrono::microseconds(50);

  // If the file turns out to be damaged, the requests before the damage have been sent; run() still
  // waits for their replies and reports them.
  void send() try {
    RecordingReader reader(arguments_.file);
    while (!stopped_ && problem_.empty() &&
           reader.tryNext([&](wire::Record::Reader record) { take(record, reader); })) {
    }
  } catch (const std::runtime_error& error) {
    problem_ = error.what();
  }

  void stop() noexcept {
    stopped_.store(true);
    dispatcher_.interrupt();
  }

  void take(wire::Record::Reader record, const RecordingReader& reader) {
    if (record.isOpened() && server_.empty())
      server_ =
          arguments_.server.empty() ? record.getOpened().getServer().cStr() : arguments_.server;
    if (!record.isMessage() || record.getMessage().getDirection() != wire::Direction::REQUEST)
      return;
    ConversionError error;
    auto message = tryFromWire(record.getMessage().getEnvelope(), kNoLimit, error);
    if (!message)
      throw std::runtime_error(
          fmt::format("{}: the message is damaged: {}", reader.place(), error.text));
    auto* const client = clientFor(record.getLink());
    if (client == nullptr) return;
    waitFor(record.getAtNs());
    if (!stopped_) send(*client, std::move(*message));
  }

  MessageClient* clientFor(std::uint64_t link) {
    auto& client = clients_[link];
    if (client) return client.get();
    client =
        std::make_unique<MessageClient>(dispatcher_, [this](Message&& message) { count(message); });
    client->bind(server_, location_);
    const auto limit = Deadline::after(arguments_.timeout);
    while (!client->isConnected() && !stopped_ && !limit.hasPassed()) dispatcher_.runOnce(limit);
    if (client->isConnected()) return client.get();
    problem_ = client->notConnectedBecause() + "; `mpf ls` shows all servers";
    return nullptr;
  }

  // Times are relative to the first request of the recording.
  void waitFor(std::int64_t atNs) {
    const auto nowNs = Clock::nowNs();
    if (requests_ == 0) {
      firstAtNs_ = atNs;
      startNs_ = nowNs;
    }
    if (arguments_.speed <= 0) return;
    const auto dueNs =
        startNs_ + replayedNs(saturatingDifference(atNs, firstAtNs_), arguments_.speed);
    while (!stopped_ && Clock::nowNs() < dueNs) dispatcher_.runOnce(Deadline::atNs(dueNs));
    late_->add(static_cast<std::uint64_t>(std::max<std::int64_t>(0, Clock::nowNs() - dueNs)));
  }

  // Waits while the queue is full: a recording may contain as many unanswered requests as its
  // server had room for, and this server may have less.
  void send(MessageClient& client, Message&& message) {
    ++requests_;
    const auto limit = Deadline::after(arguments_.timeout);
    for (;;) {
      // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
      const auto result = client.send(std::move(message), limit);
      if (result == SendResult::sent) {
        ++open_;
        break;
      }
      const bool isFull =
          result == SendResult::queueFull || result == SendResult::tooManyOutstanding;
      if (!isFull || stopped_ || limit.hasPassed()) {
        ++ends_[std::string("not sent: ") + toString(result)];
        break;
      }
      dispatcher_.runOnce(Deadline::after(kRetry));
    }
    showProgress();
  }

  void count(const Message& message) {
    if (const auto* fate = message.tryAs<RequestFate>()) {
      ++ends_[std::string(mpf::toString(fate->fate))];
      --open_;
    } else if (message.getType() != MessageType::connect && message.route().requestId != 0 &&
               (message.route().flags & kEndsRequest) != 0 && open_ > 0) {  // no further reply
      ++replied_;
      --open_;
    }
  }

  void awaitRest() {
    const auto limit = Deadline::after(arguments_.timeout);
    while (open_ > 0 && !stopped_ && !limit.hasPassed()) dispatcher_.runOnce(limit);
    if (open_ > 0) ends_["no reply yet"] += open_;
  }

  void showProgress() {
    const auto nowNs = Clock::nowNs();
    if (nowNs - shownNs_ < 1'000'000'000 || ::isatty(STDERR_FILENO) == 0) return;
    shownNs_ = nowNs;
    writeError(fmt::format("\r{} requests, {} replied ", requests_, replied_));
  }

  void report() {
    if (shownNs_ != 0) writeError("\r\x1b[K");
    if (!problem_.empty()) printError("mpf replay: {}\n", problem_);
    if (arguments_.json) {
      const nlohmann::json report{{"server", server_},
                                  {"clients", clients_.size()},
                                  {"requests", requests_},
                                  {"replied", replied_},
                                  {"ends", ends_},
                                  {"late_p50_ns", late_->percentileNs(50)},
                                  {"late_max_ns", late_->maxNs()}};
      return fmt::print("{}\n", jsonText(report));
    }
    if (requests_ == 0) return;  // stopped, or problem_ has been printed
    fmt::print("{} of {} to \"{}\": {} replied", counted(requests_, "request"),
               counted(clients_.size(), "client"), server_, replied_);
    for (const auto& [end, times] : ends_) fmt::print(", {} {}", times, end);
    if (arguments_.speed > 0) {
      fmt::print("; sent late by p50 {}, max {}",
                 durationText(static_cast<double>(late_->percentileNs(50))),
                 durationText(static_cast<double>(late_->maxNs())));
    }
    fmt::print("\n");
  }

  static constexpr ConversionLimits kNoLimit{.maxValueBytes = SIZE_MAX};

  const ReplayArguments& arguments_;
  std::int32_t location_;
  std::string server_;
  std::atomic<bool> stopped_{false};
  Dispatcher dispatcher_;
  std::map<std::uint64_t, std::unique_ptr<MessageClient>> clients_;  // by the link of the recording
  std::unique_ptr<LatencyRecorder> late_ = std::make_unique<LatencyRecorder>();
  std::map<std::string, std::uint64_t> ends_;
  std::string problem_;
  std::int64_t firstAtNs_ = 0;
  std::int64_t startNs_ = 0;
  std::int64_t shownNs_ = 0;
  std::uint64_t requests_ = 0;
  std::uint64_t replied_ = 0;
  std::uint64_t open_ = 0;
  StopSignals stop_;
};

}  // namespace

void addReplay(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "replay",
      "Sends the requests of a recording to a server, with the timing that they had; or replies as "
      "the recorded server did");
  auto arguments = std::make_shared<ReplayArguments>();
  addBackplane(command, arguments->backplane, "\"default\"");
  addLocation(command, arguments->location);
  command.add_option("file", arguments->file, "Recording that `mpf tap --write` wrote")
      ->required()
      ->check(CLI::ExistingFile);
  command.add_option("--server", arguments->server, "Name of the server; default: the recording's");
  command.add_flag("--as-server", arguments->asServer,
                   "Be the server: reply to clients as the recorded server did, with its delays");
  command
      .add_option("--speed", arguments->speed,
                  "2: twice as fast as recorded; 0: as fast as possible")
      ->capture_default_str()
      ->check(number(0, 1e6));
  addTime(command, "--timeout", arguments->timeout,
          "Longest wait for the server, for room in its queue, and for the last reply", kAboveZero);
  addJson(command, arguments->json);
  command.footer(
      "Exit status: 0 every request got a reply; 1 a request got no reply; 2 usage error. With "
      "--as-server: 0 after SIGINT or SIGTERM; 1 the server cannot start.");
  command.callback([arguments, &run] {
    run = [arguments] {
      if (!arguments->asServer) return Replayer(*arguments).run();
      return serveGhost({.file = arguments->file,
                         .backplane = arguments->backplane,
                         .server = arguments->server,
                         .location = chosenLocation(arguments->location),
                         .speed = arguments->speed,
                         .json = arguments->json});
    };
  });
}

}  // namespace mpf::tools
