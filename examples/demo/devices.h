// SPDX-License-Identifier: MIT
// DemoDevices: a client of four servers, which asks each of them once a round: a DAC, the ADC that its output is wired to, digital lines
// that are wired to each other, and an instrument on a serial line.
//
//   give() ─► all outputs are set ─► a pause ─► look() ─► what the inputs make of them, which stay as they are meanwhile
//
// Threads  one.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include <mpf/client/sync_client.h>

namespace mpf::demo {

// What a round gave; empty where there was no answer.
struct Sample {
  std::optional<double> written;   // volts on the DAC's channel 0
  std::optional<double> measured;  // the same, by the ADC's channel 0
  std::optional<std::uint8_t> outputs;  // digital lines 8 to 15
  std::optional<std::uint8_t> inputs;   // 0 to 7, as the server told last
  std::optional<double> instrument;     // volts
};

class DemoDevices {
 public:
  //   patience  longest wait for an answer: a server that is being restarted does not hold up the others for longer
  DemoDevices(const Backplane& backplane, std::chrono::milliseconds patience);

  // The DAC gives `volts`, the outputs are `bits`.
  void give(double volts, std::uint8_t bits);
  Sample look();
  // Messages that told of inputs so far, without being asked.
  [[nodiscard]] std::uint64_t told() const noexcept { return told_; }

 private:
  std::optional<Int32> call(SyncClient& client, const Int32& request);
  std::optional<double> measure();
  std::optional<double> readInstrument();
  std::optional<std::uint8_t> followInputs();

  const std::chrono::milliseconds patience_;
  SyncClient dac_, adc_, out_, in_, instrument_;
  Sample given_;
  bool isMonitoring_ = false;
  std::uint64_t told_ = 0;
  std::optional<std::uint8_t> inputs_;
};

}  // namespace mpf::demo
