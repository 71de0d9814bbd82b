// SPDX-License-Identifier: MIT
#include "tools/tap/sniffer.h"

#include <atomic>
#include <cstdio>
#include <fmt/format.h>

#include <mpf/clock.h>
#include <mpf/message_client.h>
#include <mpf/serial_sniff.h>

#include "base/print_error.h"
#include "base/stop_signals.h"
#include "tools/arguments.h"
#include "tools/tap/reader_watch.h"
#include "tools/text/show.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

class Sniffer {
 public:
  Sniffer(const SnifferOptions& options, std::unique_ptr<SniffText> text)
      : options_(options),
        program_("mpf " + options.command),
        service_(options.server + std::string(serial::sniffSuffix)),
        text_(std::move(text)),
        dispatcher_(Backplane::attach(options.backplane)),
        client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }),
        stop_([](void* self) noexcept { static_cast<Sniffer*>(self)->stop(); }, this) {
    client_.bind(service_, options.location);
  }

  int run() {
    const auto limit = Deadline::after(kConnectLimit);
    while (!client_.isConnected() && !isOver(limit)) dispatcher_.runOnce(limit);
    const auto end =
        options_.duration > Nanoseconds(0) ? Deadline::after(options_.duration) : Deadline::never();
    if (!client_.isConnected()) {
      printError("{}: {}; check with `mpf ls` that it is {}\n", program_,
                 client_.notConnectedBecause(), options_.kind);
      return 1;
    }
    while (!isOver(end)) {
      // Shows an incomplete line when the serial line has been quiet for a while.
      if (!dispatcher_.runOnce(std::min(end, Deadline::after(kQuiet)))) show(text_->flush());
    }
    drain();
    show(text_->flush() + text_->end());
    printError("{}: {} seen, {} missing\n", program_, counted(seen_, "byte"), missing_);
    return wasRefused_ ? 1 : 0;
  }

 private:
  static constexpr Nanoseconds kConnectLimit = std::chrono::seconds(2);
  static constexpr Nanoseconds kQuiet = std::chrono::milliseconds(200);
  static constexpr Nanoseconds kStopLimit = std::chrono::seconds(10);

  [[nodiscard]] bool isOver(Deadline deadline) const {
    return signals_ != 0 || wasRefused_ || deadline.hasPassed();
  }

  void stop() noexcept {
    ++signals_;
    dispatcher_.interrupt();
  }

  void take(Message&& message) {
    if (const auto* connect = message.tryAs<Connect>()) return takeConnect(*connect);
    if (const auto* fate = message.tryAs<RequestFate>()) return takeFate(*fate);
    if (const auto* reply = message.tryAs<Int32>()) return takeReply(*reply);
    if (const auto records = Char8ArrayMessage::tryFrom(std::move(message))) takeRecords(*records);
  }

  // Starts to listen again when the server has restarted.
  void takeConnect(const Connect& connect) {
    if (connect.status == ConnectStatus::connectYes) {
      static_cast<void>(client_.send(Int32Message({.cmd = serial::cmdSniffStart})));
    } else if (connect.status == ConnectStatus::connectNo) {
      isListening_ = false;
      show(text_->flush());
      printError("{}: {}\n", program_, client_.notConnectedBecause());
    }
  }

  void takeReply(const Int32& reply) {
    if (reply.cmd == serial::cmdSniffStart && reply.status == serial::sniffStatusOK) {
      isListening_ = true;
      printError("{}: listening to \"{}\"\n", program_, options_.server);
    } else if (reply.cmd == serial::cmdSniffStop) {
      isListening_ = false;
      takeMissing(static_cast<std::uint64_t>(reply.address));
    } else {
      wasRefused_ = true;
      printError("{}: \"{}\" refused to start sniffing: status {}\n", program_, service_,
                 reply.status);
    }
  }

  // After another fate than this one, the server has gone, and connectNo follows.
  void takeFate(const RequestFate& fate) {
    if (fate.fate != Fate::refused) return;
    wasRefused_ = true;
    isListening_ = false;
    printError("{}: \"{}\" refused a request to sniff; check with `mpf ls` that it is {}\n",
               program_, service_, options_.kind);
  }

  // Stops sniffing and receives the bytes of the last few milliseconds, which the server still has.
  // A further signal ends the wait for a server that does not answer.
  void drain() {
    if (!isListening_ ||
        client_.send(Int32Message({.cmd = serial::cmdSniffStop})) != SendResult::sent)
      return;
    const auto limit = Deadline::after(kStopLimit);
    const int signals = signals_;
    while (isListening_ && signals_ == signals && !limit.hasPassed()) dispatcher_.runOnce(limit);
    if (isListening_)
      printError("{}: \"{}\" did not answer: its last bytes may be missing\n", program_, service_);
  }

  void takeMissing(std::uint64_t bytes) {
    if (bytes != 0) show(text_->missing(bytes));
    missing_ += bytes;
  }

  void takeRecords(const Char8ArrayMessage& message) {
    takeMissing(static_cast<std::uint64_t>(message->address));
    std::string text;
    const auto records = text_->tryAdd(message, text);
    if (!records) return printError("{}: \"{}\" sent invalid sniff records\n", program_, service_);
    seen_ += *records;
    show(text);
  }

  const SnifferOptions options_;
  const std::string program_;
  const std::string service_;
  const std::unique_ptr<SniffText> text_;
  std::uint64_t seen_ = 0;
  std::uint64_t missing_ = 0;
  bool isListening_ = false;
  bool wasRefused_ = false;
  std::atomic<int> signals_{0};  // to stop
  Dispatcher dispatcher_;
  MessageClient client_;
  StopSignals stop_;
  ReaderWatch reader_{[this] { stop(); }};
};

}  // namespace

int sniff(const SnifferOptions& options, std::unique_ptr<SniffText> text) {
  return Sniffer(options, std::move(text)).run();
}

std::int64_t realtimeOffsetNs() { return Clock::wallNs() - Clock::nowNs(); }

}  // namespace mpf::tools
