// SPDX-License-Identifier: MIT
#include "drivers/ip330/pid_loop.h"

#include <algorithm>
#include <utility>

namespace mpf {
namespace {

double within(double value, double low, double high) {
  return std::max(low, std::min(value, high));
}

}  // namespace

void PidLoop::integrate(double change) noexcept {
  const auto& [actual, error, output, p, i, d] = terms_;
  const bool isFree = output > lowLimit && output < highLimit;
  if (isFree || (output >= highLimit && change < 0) || (output <= lowLimit && change > 0)) {
    terms_.i = within(i + change, lowLimit, highLimit);
  }
}

double PidLoop::step(double actual, double seconds) noexcept {
  const double error = setPoint - actual;
  const double change = std::exchange(hasError_, true) ? error - terms_.error : 0;
  terms_.actual = actual;
  terms_.error = error;
  terms_.p = kp * error;
  if (isOn_ && !std::exchange(isSeeded_, false)) integrate(kp * ki * error * seconds);
  if (ki == 0) terms_.i = kp > 0 ? lowLimit : highLimit;
  terms_.d = seconds > 0 ? kp * kd * change / seconds : 0;
  terms_.output = within(terms_.p + terms_.i + terms_.d, lowLimit, highLimit);
  return terms_.output;
}

}  // namespace mpf
