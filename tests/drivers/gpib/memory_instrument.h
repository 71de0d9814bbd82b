// SPDX-License-Identifier: MIT
// MemoryInstrument: an instrument that keeps what it receives, and sends what a test prepares.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/gpib/instrument_model.h"

namespace mpf::test {

class MemoryInstrument final : public GpibInstrumentModel {
 public:
  bool receive(std::uint8_t byte, bool end) override {
    if (!accepts) return false;
    received.push_back(byte);
    ends.push_back(end);
    return true;
  }
  std::optional<Byte> nextByte() override {
    if (toSend.empty()) return std::nullopt;
    const auto byte = toSend.front();
    toSend.pop_front();
    return byte;
  }
  [[nodiscard]] bool requestsService() const override { return requests; }
  std::uint8_t serialPoll() override {
    const auto before = status;
    status &= static_cast<std::uint8_t>(~0x40);
    requests = false;
    return before;
  }
  void clear() override { log += "clear "; }
  void trigger() override { log += "trigger "; }
  void setControl(Control control) override {
    log += control == Control::local    ? "local "
           : control == Control::remote ? "remote "
                                        : "lockout ";
  }

  // The last byte with END when `end`.
  void send(std::string_view text, bool end = true) {
    for (std::size_t i = 0; i < text.size(); ++i)
      toSend.push_back({static_cast<std::uint8_t>(text[i]), end && i + 1 == text.size()});
  }
  void requestService(std::uint8_t statusByte) {
    status = statusByte | 0x40;
    requests = true;
  }
  [[nodiscard]] std::string text() const { return {received.begin(), received.end()}; }

  bool accepts = true;
  bool requests = false;
  std::uint8_t status = 0;
  std::vector<std::uint8_t> received;
  std::vector<bool> ends;
  std::deque<Byte> toSend;
  std::string log;  // what happened
};

}  // namespace mpf::test
