// SPDX-License-Identifier: MIT
// mpf sniff: shows every byte that a serial server sends and receives, live (manual,
// "serialPortSniff"), without disturbing the line.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <fmt/format.h>
#include <memory>

#include <mpf/clock.h>
#include <mpf/message_client.h>
#include <mpf/serial_sniff.h>

#include "base/print_error.h"
#include "base/stop_signals.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/tap/sniff_format.h"
#include "tools/text/show.h"
#include "tools/text/wrap.h"

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
      : server_(arguments.server),
        service_(arguments.server + std::string(serial::sniffSuffix)),
        format_(SniffFormat::make(arguments.json ? "json" : arguments.format, realtimeOffsetNs())),
        seconds_(arguments.seconds),
        dispatcher_(Backplane::attach(arguments.backplane)),
        client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }),
        stop_([](void* self) noexcept { static_cast<Sniffer*>(self)->stop(); }, this) {
    client_.bind(service_, arguments.location);
  }

  int run() {
    const auto limit = Deadline::after(kConnectLimit);
    while (!client_.isConnected() && !isOver(limit)) dispatcher_.runOnce(limit);
    const auto end = seconds_ > 0 ? Deadline::after(ofSeconds(seconds_)) : Deadline::never();
    if (!client_.isConnected()) {
      printError("mpf sniff: {}; check with `mpf ls` that it is a serial server and running\n",
                 client_.notConnectedBecause());
      return 1;
    }
    while (!isOver(end)) {
      // Shows an incomplete line when the serial line has been quiet for a while.
      if (!dispatcher_.runOnce(std::min(end, Deadline::after(kQuiet)))) show(format_->flush());
    }
    drain();
    show(format_->flush());
    printError("mpf sniff: {} seen, {} missing\n", counted(seen_, "byte"), missing_);
    return wasRefused_ ? 1 : 0;
  }

 private:
  static constexpr Nanoseconds kConnectLimit = std::chrono::seconds(2);
  static constexpr Nanoseconds kQuiet = std::chrono::milliseconds(200);
  static constexpr Nanoseconds kStopLimit = std::chrono::seconds(1);

  [[nodiscard]] bool isOver(Deadline deadline) const {
    return stopped_ || wasRefused_ || deadline.hasPassed();
  }

  void stop() noexcept {
    stopped_.store(true);
    dispatcher_.interrupt();
  }

  void take(Message&& message) {
    if (const auto* connect = message.tryAs<Connect>()) return takeConnect(*connect);
    if (const auto* reply = message.tryAs<Int32>()) return takeReply(*reply);
    if (const auto records = Char8ArrayMessage::tryFrom(std::move(message))) takeRecords(*records);
  }

  // Starts to listen again when the server has restarted.
  void takeConnect(const Connect& connect) {
    if (connect.status == ConnectStatus::connectYes) {
      static_cast<void>(client_.send(Int32Message({.cmd = serial::cmdSniffStart})));
    } else if (connect.status == ConnectStatus::connectNo) {
      isListening_ = false;
      show(format_->flush());
      printError("mpf sniff: {}\n", client_.notConnectedBecause());
    }
  }

  void takeReply(const Int32& reply) {
    if (reply.cmd == serial::cmdSniffStart && reply.status == serial::sniffStatusOK) {
      isListening_ = true;
      printError("mpf sniff: listening to \"{}\"\n", server_);
    } else if (reply.cmd == serial::cmdSniffStop) {
      isListening_ = false;
      takeMissing(static_cast<std::uint64_t>(reply.address));
    } else {
      wasRefused_ = true;
      printError("mpf sniff: \"{}\" refused to start sniffing: status {}\n", service_,
                 reply.status);
    }
  }

  // Stops sniffing and receives the bytes of the last few milliseconds, which the server still has.
  void drain() {
    if (!isListening_ ||
        client_.send(Int32Message({.cmd = serial::cmdSniffStop})) != SendResult::sent)
      return;
    const auto limit = Deadline::after(kStopLimit);
    while (isListening_ && !limit.hasPassed()) dispatcher_.runOnce(limit);
  }

  void takeMissing(std::uint64_t bytes) {
    if (bytes != 0) show(format_->missing(bytes));
    missing_ += bytes;
  }

  void takeRecords(const Char8ArrayMessage& message) {
    takeMissing(static_cast<std::uint64_t>(message->address));
    const auto records = serial::tryReadRecords(message);
    if (!records) return printError("mpf sniff: \"{}\" sent invalid sniff records\n", service_);
    std::string text;
    for (const auto& record : *records) text += format_->add(record);
    seen_ += records->size();
    show(text);
  }

  std::string server_;
  std::string service_;
  std::unique_ptr<SniffFormat> format_;
  double seconds_;  // 0: until a signal
  std::uint64_t seen_ = 0;
  std::uint64_t missing_ = 0;
  bool isListening_ = false;
  bool wasRefused_ = false;
  std::atomic<bool> stopped_{false};
  Dispatcher dispatcher_;
  MessageClient client_;
  StopSignals stop_;
};

}  // namespace

void addSniff(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "sniff", "Shows every byte that a serial server sends (T) and receives (R), live");
  auto arguments = std::make_shared<SniffArguments>();
  addServer(command, *arguments);
  addSeconds(command, "seconds", arguments->seconds, "Duration; 0: until Ctrl-C", true);
  command
      .add_option("--format", arguments->format,
                  "lines: one direction in a line, with times; manual: ten bytes in a line, as in "
                  "the manual of MPF")
      ->capture_default_str()
      ->check(CLI::IsMember({"lines", "manual"}));
  addJson(command, arguments->json);
  command.callback([arguments, &run] { run = [arguments] { return Sniffer(*arguments).run(); }; });
}

}  // namespace mpf::tools
