// SPDX-License-Identifier: MIT
#include <mpf/drivers/gpib/open_gpib_controller.h>

#include <fmt/format.h>
#include <stdexcept>
#include <string>

#include <mpf/drivers/gpib/linux_gpib.h>
#include <mpf/drivers/gpib/prologix.h>
#include <mpf/drivers/gpib/usbtmc.h>

#include "base/number.h"

namespace mpf {
namespace {

constexpr std::string_view kForms =
    "prologix:HOST:PORT, prologix:/dev/ttyUSB0, usbtmc:/dev/usbtmc0, linux-gpib:0";

int boardIn(const std::string& text) {
  if (const auto board = tryNumber<int>(text)) return *board;
  throw std::invalid_argument("the board is a number, such as 0 for /dev/gpib0");
}

std::unique_ptr<GpibController> openKind(std::string_view kind, const std::string& device) {
  if (device.empty()) throw std::invalid_argument("it names no device");
  if (kind == "prologix") return openPrologix({.address = device});
  if (kind == "usbtmc") return openUsbtmc({.device = device});
  if (kind == "linux-gpib") return openLinuxGpib({.board = boardIn(device)});
  throw std::invalid_argument("unknown kind");
}

}  // namespace

std::unique_ptr<GpibController> openGpibController(std::string_view text) {
  const auto colon = text.find(':');
  const auto device = colon == std::string_view::npos ? "" : text.substr(colon + 1);
  try {
    return openKind(text.substr(0, colon), std::string(device));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(
        fmt::format("GPIB controller \"{}\": {}; the forms are {}", text, error.what(), kForms));
  }
}

}  // namespace mpf
