// SPDX-License-Identifier: MIT
#include "devices.h"

#include <charconv>
#include <cmath>
#include <string_view>

#include <mpf/digital_io_commands.h>
#include <mpf/drivers/dac128v_range.h>
#include <mpf/serial_commands.h>

namespace mpf::demo {
namespace {

using namespace std::chrono_literals;

constexpr Dac128vRange kDacRange{-10, 10};
constexpr double kAdcLow = -5, kAdcSpan = 10;
constexpr int kMeanMs = 10;
constexpr std::string_view kQuestion = "MEAS:VOLT?\n";

}  // namespace

DemoDevices::DemoDevices(const Backplane& backplane, std::chrono::milliseconds patience)
    : patience_(patience),
      dac_(backplane, "dac"),
      adc_(backplane, "adc"),
      out_(backplane, "dioOut"),
      in_(backplane, "dioIn"),
      instrument_(backplane, "voltmeter") {}

void DemoDevices::give(double volts, std::uint8_t bits) {
  given_ = {};
  const auto code = kDacRange.tryCodeOf(volts).value_or(0);
  if (call(dac_, {.address = 0, .value = code})) given_.written = kDacRange.voltsOf(code);
  if (call(out_, {.cmd = digital::cmdWriteBits, .address = 0xff00, .value = bits << 8}))
    given_.outputs = bits;
}

Sample DemoDevices::look() {
  auto sample = given_;
  sample.measured = measure();
  sample.inputs = followInputs();
  sample.instrument = readInstrument();  // last, since it is the slowest
  return sample;
}

std::optional<Int32> DemoDevices::call(SyncClient& client, const Int32& request) {
  auto answer = client.call(Int32Message(request), patience_);
  const auto reply = answer ? answer.as<Int32>() : std::nullopt;
  return reply && (*reply)->status == 0 ? std::optional(**reply) : std::nullopt;
}

std::optional<double> DemoDevices::measure() {
  const auto reply = call(adc_, {.address = 0, .extra = kMeanMs});
  return reply ? std::optional(kAdcLow + kAdcSpan * reply->value / 0xffff) : std::nullopt;
}

// The server reports each change. The monitor is started once, and again after a restart of the
// server.
std::optional<std::uint8_t> DemoDevices::followInputs() {
  while (const auto message = in_.receive(0s)) {
    const auto* const change = message.tryAs<Int32>();
    if (change == nullptr) continue;
    ++reportedChanges_;
    inputs_ = change->status == 0 ? std::optional(static_cast<std::uint8_t>(change->value))
                                  : std::nullopt;
  }
  if (!in_.client().isConnected()) isMonitoring_ = false;
  if (isMonitoring_) return inputs_;
  const auto first = call(in_, {.cmd = digital::cmdStartMonitor, .address = 0xff});
  isMonitoring_ = first.has_value();
  inputs_ = first ? std::optional(static_cast<std::uint8_t>(first->value)) : std::nullopt;
  return inputs_;
}

std::optional<double> DemoDevices::readInstrument() {
  auto request = Char8ArrayMessage::allocValue(kQuestion.size());
  request->cmd = serial::cmdWriteRead | serial::cmdTimeoutMilliseconds;
  // shorter than our own wait, so that the reply reports the timeout
  request->timeout = static_cast<std::int32_t>((patience_ * 4 / 5).count());
  std::copy(kQuestion.begin(), kQuestion.end(), request.value().begin());
  auto answer = instrument_.call(std::move(request), patience_);
  const auto reply = answer ? answer.as<Char8Array>() : std::nullopt;
  if (!reply || (*reply)->status != serial::serialServerStatusOK) return std::nullopt;
  std::string_view text(reply->value().data(), reply->value().size());
  if (text.starts_with('+')) text.remove_prefix(1);
  double volts = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), volts);
  return error == std::errc() ? std::optional(volts) : std::nullopt;
}

}  // namespace mpf::demo
