// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/serial_port.h>

#include <algorithm>

namespace mpf {

const char* toString(SerialPortStatus status) noexcept {
  switch (status) {
    case SerialPortStatus::success:
      return "success";
    case SerialPortStatus::timeout:
      return "timeout";
    case SerialPortStatus::failure:
      return "failure";
  }
  return "?";
}

const char* toString(SerialPortState state) noexcept {
  return state == SerialPortState::plugged ? "plugged" : "unplugged";
}

Deadline SerialPort::deadlineAfter(Milliseconds timeout) noexcept {
  if (timeout > std::chrono::duration_cast<Milliseconds>(Nanoseconds::max()))
    return Deadline::never();
  return Deadline::after(std::max(timeout, Milliseconds(0)));
}

}  // namespace mpf
