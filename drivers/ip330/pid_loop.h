// SPDX-License-Identifier: MIT
// PidLoop: one step of a control loop after the other, without any device.
//
//   error = setPoint - actual
//   P = KP * error      I += KP * KI * error * dt      D = KP * KD * change of error / dt      output = P + I + D, within its limits
//
// I grows no more while the output is at the limit towards which it grows, and stays within the limits itself. It begins with what the output is
// when feedback is turned on, so that nothing jumps; it does not change while feedback is off. KI of 0 makes it the low limit, or the high one
// when KP is not positive: so one tunes P alone.
//
// Threads  one at a time.
// Source   fastPID (std R1-3); there the first change of error was of whatever the memory held.
#pragma once

namespace mpf {

class PidLoop {
 public:
  double kp = 1, ki = 0, kd = 0;
  double setPoint = 0;
  double lowLimit = 0, highLimit = 0;

  struct Terms {
    double actual = 0, error = 0, output = 0, p = 0, i = 0, d = 0;
  };
  [[nodiscard]] const Terms& terms() const noexcept { return terms_; }
  void setI(double value) noexcept { terms_.i = value; }

  // Feedback goes on with the output as it is.
  void turnOn(double output) noexcept {
    terms_.i = output;
    isOn_ = isSeeded_ = true;
  }
  void turnOff() noexcept { isOn_ = false; }
  [[nodiscard]] bool isOn() const noexcept { return isOn_; }

  // What the output shall be; it is written only while feedback is on.
  //   seconds  since the last step
  double step(double actual, double seconds) noexcept;

 private:
  void integrate(double change) noexcept;

  Terms terms_;
  bool isOn_ = false;
  bool isSeeded_ = false;  // this step's I is what turnOn() said
  bool hasError_ = false;
};

}  // namespace mpf
