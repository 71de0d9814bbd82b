// SPDX-License-Identifier: MIT
// openGpibController: a GpibController from one line of text, as options of programs and crate
// files have it.
//
//   prologix:gpib1:1234       Prologix GPIB-ETHERNET                       <prologix.h>
//   prologix:/dev/ttyUSB0     Prologix GPIB-USB                            <prologix.h>
//   usbtmc:/dev/usbtmc0       USB instrument                               <usbtmc.h>
//   linux-gpib:0              board with a driver of Linux GPIB            <linux_gpib.h>
//
// Threads  any.
#pragma once

#include <memory>
#include <string_view>

#include <mpf/drivers/gpib/gpib_controller.h>

namespace mpf {

//   throws  std::invalid_argument with the text and the valid forms;
//           std::runtime_error when the controller cannot be used, as the headers say
[[nodiscard]] std::unique_ptr<GpibController> openGpibController(std::string_view text);

}  // namespace mpf
