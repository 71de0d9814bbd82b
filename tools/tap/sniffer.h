// SPDX-License-Identifier: MIT
// Sniffer: listens to a serial or GPIB server and prints every byte, live: the loop of `mpf sniff`
// and `mpf gpib-sniff` (include/mpf/serial_sniff.h, gpib_sniff.h).
//
// Threads  the main thread of the program.
// Crash    the server notices that the listener is gone.
// Trust    records that are invalid are reported and not printed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <mpf/clock.h>
#include <mpf/message_of.h>

namespace mpf::tools {

// The records of one kind of server as text.
class SniffText {
 public:
  SniffText() = default;
  SniffText(const SniffText&) = delete;
  SniffText& operator=(const SniffText&) = delete;
  virtual ~SniffText() = default;
  // Appends the records of a message to `text`, as far as they are complete lines.
  //   returns  how many there are; nullopt: the message is invalid
  virtual std::optional<std::size_t> tryAdd(const Char8ArrayMessage& message,
                                            std::string& text) = 0;
  [[nodiscard]] virtual std::string missing(std::uint64_t bytes) = 0;
  // The incomplete line: for pauses.
  [[nodiscard]] virtual std::string flush() = 0;
  // The last text.
  [[nodiscard]] virtual std::string end() = 0;
};

// A SniffText of a format with tryRead(message), which returns records, and add(record).
template <class Format>
class SniffTextOf final : public SniffText {
 public:
  explicit SniffTextOf(std::unique_ptr<Format> format) : format_(std::move(format)) {}

  std::optional<std::size_t> tryAdd(const Char8ArrayMessage& message, std::string& text) override {
    const auto records = Format::tryRead(message);
    if (!records) return std::nullopt;
    for (const auto& record : *records) text += format_->add(record);
    return records->size();
  }
  std::string missing(std::uint64_t bytes) override { return format_->missing(bytes); }
  std::string flush() override { return format_->flush(); }
  std::string end() override { return format_->end(); }

 private:
  const std::unique_ptr<Format> format_;
};

struct SnifferOptions {
  std::string command;  // "sniff", for messages to people
  std::string kind;  // "a serial server"
  std::string backplane;
  std::int32_t location = 0;
  std::string server;
  Nanoseconds duration{0};  // 0: until a signal
};

// Listens for the time or until SIGINT or SIGTERM. Returns the exit status.
[[nodiscard]] int sniff(const SnifferOptions& options, std::unique_ptr<SniffText> text);

// Wall clock minus CLOCK_MONOTONIC [ns].
[[nodiscard]] std::int64_t realtimeOffsetNs();

}  // namespace mpf::tools
