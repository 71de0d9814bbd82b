// SPDX-License-Identifier: MIT
// AnalogOutput: one channel of a converter that a control loop drives, whichever it is.
#pragma once

#include <optional>

namespace mpf {

class AnalogOutput {
 public:
  AnalogOutput() = default;
  AnalogOutput(const AnalogOutput&) = delete;
  AnalogOutput& operator=(const AnalogOutput&) = delete;
  virtual ~AnalogOutput() = default;

  // What it puts out now, in codes; nullopt when it does not answer.
  [[nodiscard]] virtual std::optional<double> tryRead() = 0;
  // False: it did not take it.
  [[nodiscard]] virtual bool tryWrite(double codes) = 0;
};

}  // namespace mpf
