// SPDX-License-Identifier: MIT
// mpf sniff: every byte that a serial server sends and receives, live (manual, "serialPortSniff"). The line does not notice.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <fmt/format.h>
#include <memory>

#include <mpf/base/clock.h>
#include <mpf/base/stop_signals.h>
#include <mpf/client/message_client.h>
#include <mpf/schema/serial_sniff.h>
#include <mpf/tools/arguments.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/sniff_format.h>

namespace mpf::tools {
namespace {

struct SniffArguments : ServerArguments {
  double seconds = 0;
  std::string format = "lines";
  bool json = false;
};

std::int64_t realtimeOffsetNs() {
  timespec wall{};
  ::clock_gettime(CLOCK_REALTIME, &wall);
  return std::int64_t{wall.tv_sec} * 1'000'000'000 + wall.tv_nsec - Clock::nowNs();
}

class Sniffer {
 public:
  explicit Sniffer(const SniffArguments& arguments)
      : service_(arguments.server + std::string(serial::sniffSuffix)),
        format_(SniffFormat::make(arguments.json ? "json" : arguments.format, realtimeOffsetNs())),
        end_(arguments.seconds > 0 ? Deadline::after(Nanoseconds(static_cast<std::int64_t>(arguments.seconds * 1e9))) : Deadline::never()),
        dispatcher_(Backplane::attach(arguments.backplane)),
        client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }),
        stop_([](void* self) noexcept { static_cast<Sniffer*>(self)->stop(); }, this) {
    client_.bind(service_, arguments.location);
  }

  int run() {
    if (!client_.connectWait(std::min(kConnectLimit, end_.left()))) {
      fmt::print(stderr, "mpf sniff: {}; is it a serial server, and does it run? `mpf ls` shows\n", client_.notConnectedBecause());
      return 1;
    }
    while (!stopped_ && !end_.hasPassed()) {
      // What was begun is shown when the line has been quiet for a while.
      if (!dispatcher_.runOnce(std::min(end_, Deadline::after(kQuiet)))) show(format_->flush());
    }
    show(format_->flush());
    fmt::print(stderr, "mpf sniff: {} bytes seen, {} missing\n", seen_, missing_);
    return 0;
  }

 private:
  static constexpr Nanoseconds kConnectLimit = std::chrono::seconds(2);
  static constexpr Nanoseconds kQuiet = std::chrono::milliseconds(200);

  void stop() noexcept {
    stopped_.store(true);
    dispatcher_.interrupt();
  }

  void take(Message&& message) {
    if (const auto* news = message.tryAs<Connect>()) return takeNews(*news);
    if (const auto records = Char8ArrayMessage::tryFrom(std::move(message))) takeRecords(*records);
  }

  // A server that comes back is listened to again.
  void takeNews(const Connect& news) {
    if (news.status == ConnectStatus::connectYes) {
      static_cast<void>(client_.send(Int32Message({.cmd = serial::cmdSniffStart})));
    } else if (news.status == ConnectStatus::connectNo) {
      show(format_->flush());
      fmt::print(stderr, "mpf sniff: {}\n", client_.notConnectedBecause());
    }
  }

  void takeRecords(const Char8ArrayMessage& message) {
    const auto lost = static_cast<std::uint64_t>(message->address);
    if (lost != 0) show(format_->missing(lost));
    missing_ += lost;
    const auto records = serial::tryReadRecords(message);
    if (!records) return fmt::print(stderr, "mpf sniff: \"{}\" sent what is no record\n", service_);
    std::string text;
    for (const auto& record : *records) text += format_->add(record);
    seen_ += records->size();
    show(text);
  }

  static void show(const std::string& text) {
    if (text.empty()) return;
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }

  std::string service_;
  std::unique_ptr<SniffFormat> format_;
  Deadline end_;
  std::uint64_t seen_ = 0;
  std::uint64_t missing_ = 0;
  std::atomic<bool> stopped_{false};
  Dispatcher dispatcher_;
  MessageClient client_;
  StopSignals stop_;
};

}  // namespace

void addSniff(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("sniff", "Every byte that a serial server sends (T) and receives (R), live");
  auto arguments = std::make_shared<SniffArguments>();
  addServer(command, *arguments);
  command.add_option("seconds", arguments->seconds, "For how long; 0: until Ctrl-C")->capture_default_str()->check(CLI::NonNegativeNumber);
  command.add_option("--format", arguments->format, "lines: one direction a line, with times; manual: ten bytes a line, as of old")
      ->capture_default_str()
      ->check(CLI::IsMember({"lines", "manual"}));
  addJson(command, arguments->json);
  command.callback([arguments, &run] { run = [arguments] { return Sniffer(*arguments).run(); }; });
}

}  // namespace mpf::tools
