// SPDX-License-Identifier: MIT
// PrologixLink: the connection to a Prologix controller. It sends commands, and returns what the
// controller answers to exactly these commands.
//
//   sent                      received
//   ++eot_char 137            -                         the mark of this exchange: 128 to 255
//   ++addr 22, ++read eoi     1.5 \r \n 137             the controller appends the mark to END
//   ++ver                     Prologix GPIB-... \r \n   ┐ the end of the answer, which no
//   ++eot_char                137 \r \n                 ┘ instrument sends
//
// The controller executes its commands in order, so what it sends before the end belongs to the
// commands of this exchange. The answer to an earlier one, which came late, ends with another mark.
//
//              version and mark have arrived: configured
//   unknown ────────────────────────────────────────────► ready
//           ◄────────────────────────────────────────────
//            connection lost, or the end did not arrive before the deadline
//
// An exchange in the state `unknown` connects, sets the controller up and skips what arrives before
// the mark. If there is no mark within `patience`, the next exchange opens a new connection.
//
// Threads  one caller at a time; the port has a thread of its own.
// Trust    an answer has kMostBytes at most.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <mpf/drivers/gpib/gpib_types.h>
#include <mpf/drivers/serial/serial_port.h>

namespace mpf {

class PrologixLink {
 public:
  // Opens the port; returns at once, even when the controller is absent.
  using OpenPort = std::function<std::unique_ptr<SerialPort>()>;
  // Longer than the longest ++read_tmo_ms, during which a controller executes nothing else.
  static constexpr std::chrono::milliseconds kUsualPatience{5000};
  static constexpr std::size_t kMostBytes = 64 << 20;

  struct Answer {
    GpibResult result;
    // What the controller sent before the end of the answer, as far as it has arrived.
    std::vector<std::uint8_t> bytes;
    // All of it has arrived; possible also on a timeout, when a part of the end has arrived.
    bool isComplete = false;
    std::uint8_t mark = 0;
    // Nothing arrived for half of `silence` right before the end: ++read has timed out.
    bool endsWithSilence = false;
  };
  struct Request {
    std::string commands;  // whole lines
    Deadline deadline;
    std::chrono::milliseconds silence{0};  // the ++read_tmo_ms in `commands`, if there is one
    std::optional<std::uint8_t> otherMarkThan{};
  };

  //   patience  longest time for the connection, and for the answer to ++ver
  PrologixLink(std::string description, OpenPort openPort,
               std::chrono::milliseconds patience = kUsualPatience);

  [[nodiscard]] Answer exchange(const Request& request);
  [[nodiscard]] const std::string& description() const noexcept { return description_; }

 private:
  enum class State : std::uint8_t { unknown, ready };
  // Collects the bytes of a request until they end with `expectedEnd`.
  class Collector final : public ByteHandler {
   public:
    // To be called before each request.
    void expect(std::string end, std::chrono::milliseconds silence);
    // What arrived during the last request.
    [[nodiscard]] std::string_view answer() const noexcept { return answer_; }
    // Whether nothing had arrived for a while before the byte at `offset` of the answer came.
    [[nodiscard]] bool hadSilenceBefore(std::size_t offset) const noexcept {
      return silenceBefore_ == offset;
    }

    ByteHandlerResult readBegins() override;
    ByteHandlerResult byteReceived(std::uint8_t byte) override;
    void readEnds(SerialPortStatus status) override;

   private:
    std::string expectedEnd_;
    std::int64_t silenceNs_ = 0;
    std::string answer_;
    // used by the port's thread during a request:
    bool isReading_ = false;
    std::string bytes_;
    std::int64_t lastNs_ = 0;  // when the last byte came, or the request began
    std::optional<std::size_t> silenceBefore_;
  };

  GpibResult identify(Deadline deadline);
  GpibResult takeVersion(std::string_view end);
  GpibResult connect(Deadline deadline);
  void becomeUnknown();
  void open();
  GpibResult tryReopen();
  GpibResult transact(std::string_view text, Deadline deadline);
  [[nodiscard]] bool wasLost() const;
  [[nodiscard]] GpibResult explainMissingVersion(GpibStatus status) const;
  std::uint8_t nextMark(std::optional<std::uint8_t> otherThan);

  const std::string description_;
  const OpenPort openPort_;
  const std::chrono::milliseconds patience_;
  Collector collector_;
  std::unique_ptr<SerialPort> port_;
  std::optional<BoundSerialPort> binding_;  // after port_ and collector_: released first
  State state_ = State::unknown;
  Deadline reopenAt_ = Deadline::never();  // in the state `unknown`, from the first attempt on
  std::uint64_t unplugs_ = 0;  // of the port, when the controller was set up
  std::string version_;
  std::uint8_t mark_;
};

}  // namespace mpf
