// SPDX-License-Identifier: MIT
// openPrologix: a Prologix GPIB-ETHERNET or GPIB-USB controller, or one that understands the same
// commands, as a GpibController.
//
//   GpibBus bus(openPrologix({.address = "gpib1:1234"}));      // TCP; usual port: 1234
//   GpibBus bus(openPrologix({.address = "/dev/ttyUSB0"}));    // a terminal line of this host
//
// openPrologix() returns at once. The first operation connects to the controller and checks that it
// is a Prologix; so does the first operation after a lost connection or after an operation that
// timed out. A late answer is therefore never taken for the answer to a later operation.
//
// What the hardware cannot do, or does in its own way:
//   commands         sendCommands(), clearAll(), remoteEnable(false) where the controller has no
//                    ++ren, and trigger() of more than 15 instruments at once: `unsupported`
//   write            the controller does not report that nobody listens: the write succeeds. Long
//                    messages are sent in pieces of about 100 bytes, END with the last of them
//   read             has no count: bytes beyond maxBytes are kept for the next read from the same
//                    address, until a write, a clear or IFC. A read without END and end-of-string
//                    byte ends when the instrument is silent for 3/4 of the time that is left
//   service request  not reported; requestsService() asks for it
//   commands of the bus are not visible to peek handlers
//
// Threads  see GpibController. The connection has a thread of its own.
// Trust    what the controller sends is checked; an answer without end costs its operation only.
// Source   Prologix GPIB-ETHERNET and GPIB-USB user manuals.
#pragma once

#include <memory>
#include <string>

#include <mpf/drivers/gpib/gpib_controller.h>

namespace mpf {

struct PrologixOptions {
  // "host:port", or the path of a terminal device, which begins with '/'.
  std::string address;
};

//   throws  std::invalid_argument for a text that is neither;
//           std::system_error when the process has no more descriptors or threads
[[nodiscard]] std::unique_ptr<GpibController> openPrologix(const PrologixOptions& options);

}  // namespace mpf
