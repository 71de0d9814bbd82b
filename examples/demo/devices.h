// SPDX-License-Identifier: MIT
// DemoDevices: a client of four servers, which calls each of them once in a round: a DAC, the ADC
// that its output is wired to, digital lines that are wired to each other, and an instrument on a
// serial line.
//
//   give() ─► sets all outputs ─► the caller pauses ─► look() ─► reads all inputs
//
// Threads  one.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include <mpf/sync_client.h>

namespace mpf::demo {

// The values of a round; nullopt where a server did not answer.
struct Sample {
  std::optional<double> written;   // volts at channel 0 of the DAC
  std::optional<double> measured;  // volts measured by channel 0 of the ADC
  std::optional<std::uint8_t> outputs;  // digital lines 8 to 15
  std::optional<std::uint8_t> inputs;   // digital lines 0 to 7, as the server last reported
  std::optional<double> instrument;     // volts
};

class DemoDevices {
 public:
  //   patience  longest wait for an answer, so that a server that is restarted does not delay the
  //             others
  DemoDevices(const Backplane& backplane, std::chrono::milliseconds patience);

  // Sets the DAC to `volts` and the digital outputs to `bits`.
  void give(double volts, std::uint8_t bits);
  Sample look();
  // Number of messages that reported changes of the inputs.
  [[nodiscard]] std::uint64_t reportedChanges() const noexcept { return reportedChanges_; }

 private:
  std::optional<Int32> call(SyncClient& client, const Int32& request);
  std::optional<double> measure();
  std::optional<double> readInstrument();
  std::optional<std::uint8_t> followInputs();

  const std::chrono::milliseconds patience_;
  SyncClient dac_, adc_, out_, in_, instrument_;
  Sample given_;
  bool isMonitoring_ = false;
  std::uint64_t reportedChanges_ = 0;
  std::optional<std::uint8_t> inputs_;
};

}  // namespace mpf::demo
