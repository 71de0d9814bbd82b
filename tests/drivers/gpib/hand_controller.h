// SPDX-License-Identifier: MIT
// HandController: drives the lines of a GpibBusModel as a test says.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/gpib/bus_model.h"
#include "drivers/gpib/bus_participant.h"

namespace mpf::test {

class HandController final : public GpibParticipant {
 public:
  explicit HandController(GpibBusModel& bus) : bus_(bus) {
    bus_.connect(*this);
    drive(gpib_line::kRen);
  }
  ~HandController() override { bus_.disconnect(*this); }

  GpibLines follow(const GpibLines& /*seen*/) override { return driven_; }
  bool offer(const GpibLines& /*seen*/) override { return false; }

  // Drives exactly these lines.
  void drive(std::uint8_t control, std::uint8_t data = 0) {
    bus_.access([&](const GpibLines& /*lines*/) { driven_ = {control, data}; });
  }
  [[nodiscard]] bool isActive(gpib_line::Line line) const { return bus_.lines().has(line); }

  // Sends a byte: returns whether all acceptors were ready, and have accepted it.
  bool send(std::uint8_t byte, std::uint8_t lines) {
    drive(lines | gpib_line::kRen);
    if (isActive(gpib_line::kNrfd) || !isActive(gpib_line::kNdac)) return false;
    drive(lines | gpib_line::kRen | gpib_line::kDav, byte);
    const bool isAccepted = !isActive(gpib_line::kNdac);
    drive(lines | gpib_line::kRen);
    return isAccepted;
  }
  bool command(std::uint8_t byte) { return send(byte, gpib_line::kAtn); }
  void commands(std::string_view bytes) {
    for (const char byte : bytes) command(static_cast<std::uint8_t>(byte));
  }
  bool data(std::uint8_t byte, bool end = false) { return send(byte, end ? gpib_line::kEoi : 0); }

  // Receives a byte, as the only listener. END is added as "!"; "" when the talker offers none.
  std::string receive() {
    drive(gpib_line::kRen | gpib_line::kNdac);
    if (!isActive(gpib_line::kDav)) return "";
    std::string text(1, static_cast<char>(bus_.lines().data));
    if (isActive(gpib_line::kEoi)) text += '!';
    drive(gpib_line::kRen | gpib_line::kNrfd);
    drive(gpib_line::kRen | gpib_line::kNrfd | gpib_line::kNdac);
    return text;
  }

 private:
  GpibBusModel& bus_;
  GpibLines driven_;
};

}  // namespace mpf::test
