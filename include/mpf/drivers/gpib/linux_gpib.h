// SPDX-License-Identifier: MIT
// openLinuxGpib: a board with a driver of Linux GPIB (/dev/gpib0) as a GpibController.
//
//   GpibBus bus(openLinuxGpib({.board = 0}));
//
// The library libgpib is loaded when a board is opened, so MPF needs it neither to build nor to run
// on a host without such a board. The board must be configured (gpib_config) and be the system
// controller. Its own address is read when it is opened, and is taken to be 0 while it is absent.
//
// libgpib supports only the timeouts 1, 3, 10, 30 ms ... 1000 s: a write, a command or a poll that
// the bus does not accept ends at the first of these times after its deadline. A read is divided
// into such times, and ends at its deadline. With endOfString, a byte that is the end of the string
// and has END counts as without END, because libgpib does not tell them apart.
//
// Service requests are not reported; requestsService() looks at the SRQ line, and cannot tell where
// the board has no monitor of its lines.
//
// Threads  see GpibController.
// Source   Linux GPIB documentation, "Linux-GPIB Reference".
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/gpib/gpib_controller.h>

namespace mpf {

struct LinuxGpibOptions {
  int board = 0;  // 0 to 15: the number of /dev/gpib0
  std::string library = "libgpib.so.0";  // a name that the dynamic loader finds, or a path
};

//   throws  std::runtime_error when the library is absent or lacks a function;
//           std::invalid_argument for a number that no board can have
[[nodiscard]] std::unique_ptr<GpibController> openLinuxGpib(const LinuxGpibOptions& options = {});

}  // namespace mpf
