// SPDX-License-Identifier: MIT
// openUsbtmc: a USB instrument behind the kernel's driver usbtmc (/dev/usbtmc0) as a GPIB bus with
// one instrument.
//
//   GpibBus bus(openUsbtmc({.device = "/dev/usbtmc0"}));
//
// openUsbtmc() returns at once. The first operation opens the device; so does the first operation
// after it was unplugged. A USB instrument has no GPIB address, so every address means it: links
// and programs that were written for a GPIB bus keep their addresses.
//
// What differs from a GPIB bus:
//   interfaceClear   only checks that the instrument is present
//   sendCommands     `unsupported`; so are trigger, local lockout, go to local and REN off where
//                    the instrument does not have them
//   service request  the kernel notes it; requestsService() asks the kernel, not the instrument
//   endOfString      an instrument that cannot stop there sends its whole message, and the next
//                    read gets the rest
//
// The kernel waits for 100 ms at least, so an operation may exceed its deadline by that time, and
// by the time of the abort that the kernel then does (100 ms, more if the instrument does not
// answer).
//
// Threads  see GpibController.
// Source   USBTMC and USBTMC-USB488 specifications; <linux/usb/tmc.h>, Linux 4.20 or newer.
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/gpib/gpib_controller.h>

namespace mpf {

struct UsbtmcOptions {
  std::string device;  // the path of the device, such as /dev/usbtmc0
};

// Returns the controller. The first operation opens the device, and fails if it is absent.
//   throws  std::bad_alloc
[[nodiscard]] std::unique_ptr<GpibController> openUsbtmc(const UsbtmcOptions& options);

}  // namespace mpf
