// SPDX-License-Identifier: MIT
// FickleLine: a serial line with an instrument at its far end that answers "Q17\n" with "A17\r\n":
// in time, late, in pieces, twice, half, or not at all, at random. It keeps the limits of
// LineLimits exactly: bytes that are due have arrived, whenever a thread reads them.
//
//   tryWrite("Q17\n") ──► outputs: { due at, bytes }, ... ──► tryRead(): outputs that are due
//                                    └─ a timer makes the line readable when one is due
//
// Threads  the port's; counts are read after the port has ended.
#pragma once

#include <sys/timerfd.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "base/timespec.h"
#include "drivers/serial/serial_line.h"
#include "server/programs/serial_server/line_limits.h"
#include "tests/support/random.h"

namespace mpf::test {

enum class Mood : std::uint8_t {
  inTime,
  late,
  lateInPieces,
  inPieces,
  twice,
  lateTwice,
  half,
  never
};
inline constexpr std::array kMoods{Mood::inTime,   Mood::late,  Mood::lateInPieces,
                                   Mood::inPieces, Mood::twice, Mood::lateTwice,
                                   Mood::half,     Mood::never};
using MoodCounts = std::array<std::uint64_t, kMoods.size()>;

class FickleLine : public SerialLine {
 public:
  // One question in `oneIn` has no complete answer immediately. A question may have any timeout, 0
  // included.
  FickleLine(const LineLimits& limits, std::uint64_t oneIn, MoodCounts& counts)
      : limits_(limits), oneIn_(oneIn), counts_(counts) {}

  [[nodiscard]] std::string description() const override { return "a fickle line"; }
  [[nodiscard]] std::string problem() const override { return {}; }
  [[nodiscard]] OpenState tryOpen() override { return OpenState::open; }
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override { return {}; }
  void close() noexcept override {}
  [[nodiscard]] pollfd waitsFor() const noexcept override { return {timer_.get(), POLLIN, 0}; }
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override {
    const auto nowNs = Clock::nowNs();
    const auto later =
        std::ranges::find_if(outputs_, [&](const Output& output) { return output.atNs > nowNs; });
    for (auto output = outputs_.begin(); output != later; ++output) {
      for (const char byte : output->bytes) bytes.push_back({static_cast<std::uint8_t>(byte)});
    }
    outputs_.erase(outputs_.begin(), later);
    setTimer();
    return true;
  }
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override {
    for (const auto byte : bytes) {
      if (byte == '\n') {
        answer("A" + question_.substr(1) + "\r\n");
        question_.clear();
      } else {
        question_ += static_cast<char>(byte);
      }
    }
    setTimer();
    return bytes.size();
  }
  [[nodiscard]] std::string tryConfigure(const SerialSettings& /*settings*/) override { return {}; }
  [[nodiscard]] bool trySetBreak(bool /*on*/) noexcept override { return false; }

 private:
  struct Output {
    std::int64_t atNs = 0;
    std::string bytes;
  };
  using Ns = std::chrono::nanoseconds;

  // A random time from 0 to less than `most`.
  std::int64_t someNs(Ns most) {
    return static_cast<std::int64_t>(
        random_.below(static_cast<std::uint64_t>(std::max<std::int64_t>(most.count(), 1))));
  }

  void answer(const std::string& text) {
    const auto nowNs = Clock::nowNs();
    const auto mood =
        random_.oneIn(oneIn_) ? kMoods[1 + random_.below(kMoods.size() - 1)] : Mood::inTime;
    ++counts_[static_cast<std::size_t>(mood)];
    const auto lateNs = nowNs + someNs(limits_.resyncLimit);
    switch (mood) {
      case Mood::inTime:
        return add(nowNs, text);
      case Mood::late:
        return add(lateNs, text);
      case Mood::lateInPieces:
        return addPieces(lateNs, text, limits_.quietTime);
      case Mood::inPieces:
        return addPieces(nowNs, text, limits_.quietTime);
      case Mood::twice:
        add(nowNs, text);
        return add(nowNs + someNs(limits_.settleTime), text);
      case Mood::lateTwice:
        add(lateNs, text);
        return add(lateNs + someNs(std::min(limits_.settleTime, limits_.quietTime)), text);
      case Mood::half:
        return add(nowNs, text.substr(0, 1 + random_.below(text.size() - 1)));
      case Mood::never:
        return;
    }
  }
  void addPieces(std::int64_t atNs, const std::string& text, Ns pause) {
    for (const char byte : text) {
      add(atNs, std::string(1, byte));
      atNs += someNs(pause);
    }
  }
  void add(std::int64_t atNs, const std::string& bytes) {
    const auto after =
        std::ranges::find_if(outputs_, [&](const Output& output) { return output.atNs > atNs; });
    outputs_.insert(after, {atNs, bytes});
  }
  void setTimer() {
    itimerspec at{};
    if (!outputs_.empty()) at.it_value = timespecOf(outputs_.front().atNs);
    checkCall(::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &at, nullptr), "timerfd_settime");
  }

  const LineLimits limits_;
  const std::uint64_t oneIn_;
  MoodCounts& counts_;
  Random random_;
  std::string question_;  // begun
  std::vector<Output> outputs_;  // in the order of their times
  FileDescriptor timer_{
      checkCall(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC), "timerfd_create")};
};

}  // namespace mpf::test
