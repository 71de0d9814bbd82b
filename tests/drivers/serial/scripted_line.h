// SPDX-License-Identifier: MIT
// ScriptedLine: a serial line whose functions return what the test has put into a LineScript, and
// that records the calls that change a line.
//
// Threads  one at a time.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "drivers/serial/serial_line.h"

namespace mpf::test {

struct LineScript {
  SerialLine::OpenState open = SerialLine::OpenState::open;
  std::string problem{};
  std::chrono::milliseconds openTimeout{};
  pollfd waitsFor{-1, 0, 0};
  bool isLost = false;
  std::string received{};  // for tryRead()
  std::size_t accepts = 0;  // bytes of each tryWrite()
  std::chrono::milliseconds timeToSend{};
  std::uint64_t overruns = 0;
  std::string refusal{};  // of settings
  bool canBreak = false;
  std::vector<std::string> calls{};  // "open", "close", "discard"

  [[nodiscard]] auto callsOf(const std::string& call) const {
    return std::count(calls.begin(), calls.end(), call);
  }
};

class ScriptedLine final : public SerialLine {
 public:
  // `script` must outlive the line.
  explicit ScriptedLine(LineScript& script) : script_(script) {}

  [[nodiscard]] std::string description() const override { return "scripted line"; }
  [[nodiscard]] std::string problem() const override { return script_.problem; }
  [[nodiscard]] OpenState tryOpen() override {
    script_.calls.emplace_back("open");
    return script_.open;
  }
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override {
    return script_.openTimeout;
  }
  void close() noexcept override { script_.calls.emplace_back("close"); }
  [[nodiscard]] pollfd waitsFor() const noexcept override { return script_.waitsFor; }
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override {
    for (const char byte : script_.received) bytes.push_back({static_cast<std::uint8_t>(byte)});
    return !script_.isLost;
  }
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override {
    return script_.isLost ? std::nullopt : std::optional(std::min(bytes.size(), script_.accepts));
  }
  [[nodiscard]] std::chrono::milliseconds timeToSend() const override { return script_.timeToSend; }
  void discardUnsent() noexcept override { script_.calls.emplace_back("discard"); }
  [[nodiscard]] std::uint64_t takeOverruns() noexcept override { return script_.overruns; }
  [[nodiscard]] std::string tryConfigure(const SerialSettings& /*settings*/) override {
    return script_.refusal;
  }
  [[nodiscard]] bool trySetBreak(bool /*on*/) noexcept override { return script_.canBreak; }

 private:
  LineScript& script_;
};

}  // namespace mpf::test
