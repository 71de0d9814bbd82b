// SPDX-License-Identifier: MIT
// OctalOptions: the options that define octal UARTs and their ports, with the parameters of the old
// commands.
//
//   --octal-uart MODULE,CARRIER,SITE,NPORTS[,VECTOR]                        initOctalUART
//   --octal-port PORT,MODULE,N[,BAUD[,PARITY[,STOPBITS[,BITS[,FLOW]]]]]     initOctalUARTPort
//
// Threads  the main thread of the program, at start.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/serial/serial_settings.h>

#include "drivers/octal_uart/octal_uart_model.h"
#include "server/programs/hardware/hardware.h"

namespace mpf {

struct OctalUartStart {
  ModulePlace place;
  int ports = 8;
  std::optional<int> vector;
};

struct OctalPortStart {
  std::string name;
  std::string module;
  int number = 0;
  SerialSettings settings{9600, 1, 8, 'N', 'N'};
};

struct OctalOptions {
  std::vector<OctalUartStart> uarts;
  std::vector<OctalPortStart> ports;
  OctalUartModelOptions model{.terminals = true};

  // Adds the options to `app`, which fills this and must not outlive it.
  void addTo(CLI::App& app);
  // Return null when no port, or module, has that name.
  [[nodiscard]] const OctalPortStart* find(const std::string& port) const;
  [[nodiscard]] const OctalUartStart* findUart(const std::string& module) const;
};

}  // namespace mpf
