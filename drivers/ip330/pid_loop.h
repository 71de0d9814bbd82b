// SPDX-License-Identifier: MIT
// PidLoop: computes the steps of a PID control loop; independent of any device.
//
//   error = setPoint - actual
//   P = KP * error      I += KP * KI * error * dt      D = KP * KD * change of error / dt
//   output = P + I + D, within its limits
//
// I does not change towards a limit while the output is at that limit, and is itself within the
// limits. When feedback is turned on, I starts with the present output, so that the output does not
// jump. I does not change while feedback is off. With KI = 0, I is the low limit, or the high limit
// if KP is not positive; this is used to tune P alone.
//
// Threads  one at a time.
// Source   EPICS fastPID (std R1-3), where the first change of error was computed from
//          uninitialised memory.
#pragma once

namespace mpf {

class PidLoop {
 public:
  double kp = 1, ki = 0, kd = 0;  // ki [1/s], kd [s]
  double setPoint = 0;
  double lowLimit = 0, highLimit = 0;

  struct Terms {
    double actual = 0, error = 0, output = 0, p = 0, i = 0, d = 0;
  };
  [[nodiscard]] const Terms& terms() const noexcept { return terms_; }
  void setI(double value) noexcept { terms_.i = value; }

  // Turns feedback on; it starts from `output`, the present value.
  void turnOn(double output) noexcept {
    terms_.i = output;
    isOn_ = isSeeded_ = true;
  }
  void turnOff() noexcept { isOn_ = false; }
  [[nodiscard]] bool isOn() const noexcept { return isOn_; }

  // Computes a step and returns the new output, which the caller writes only while feedback is on.
  //   seconds  time since the last step
  double step(double actual, double seconds) noexcept;

 private:
  void integrate(double change) noexcept;

  Terms terms_;
  bool isOn_ = false;
  bool isSeeded_ = false;  // turnOn() has set I; the next step keeps it
  bool hasError_ = false;
};

}  // namespace mpf
