// SPDX-License-Identifier: MIT
// Dac128vOutput: a channel of a DAC128V as the output of a feedback loop.
#pragma once

#include <algorithm>
#include <cmath>

#include <mpf/drivers/dac128v.h>

#include "drivers/ip330/analog_output.h"

namespace mpf {

class Dac128vOutput final : public AnalogOutput {
 public:
  Dac128vOutput(Dac128v& dac, int channel) : dac_(dac), channel_(channel) {}
  [[nodiscard]] std::optional<double> tryRead() override {
    const auto code = dac_.tryRead(channel_);
    return code ? std::optional<double>(*code) : std::nullopt;
  }
  [[nodiscard]] bool tryWrite(double codes) override {
    const double code = std::clamp(std::round(codes), 0.0, static_cast<double>(Dac128v::kMaxCode));
    return dac_.tryWrite(channel_, static_cast<int>(code)) == Dac128vStatus::success;
  }

 private:
  Dac128v& dac_;
  int channel_;
};

}  // namespace mpf
