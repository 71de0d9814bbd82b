// SPDX-License-Identifier: MIT
// AnalogOutput: one output channel that a control loop drives, of any converter.
//
// Threads  one at a time.
#pragma once

#include <optional>

namespace mpf {

class AnalogOutput {
 public:
  AnalogOutput() = default;
  AnalogOutput(const AnalogOutput&) = delete;
  AnalogOutput& operator=(const AnalogOutput&) = delete;
  virtual ~AnalogOutput() = default;

  // Returns the present output [codes]; nullopt when the converter does not answer.
  [[nodiscard]] virtual std::optional<double> tryRead() = 0;
  // Sets the output [codes]. Returns false when the converter did not accept it.
  [[nodiscard]] virtual bool tryWrite(double codes) = 0;
};

}  // namespace mpf
