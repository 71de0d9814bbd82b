// SPDX-License-Identifier: MIT
// SerialLines: the serial ports and servers of a startup file. All ports of a module belong to one
// process; every other port has a process of its own.
//
//   initOctalUART() ── module ◄── initOctalUARTPort() ── port ◄── initSerialServer() ── server
//   initTtyPort(), initInetPort() ────────────────────── port ◄──┘
//
// Threads  one.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "crate/config/crate.h"

namespace mpf::startup {

// A module of serial ports: initOctalUART().
struct SerialModule {
  std::string name, carrier, site;
  std::int64_t ports = 8;
  std::int64_t vector = 0;
  std::string place, source;
};

struct LineSettings {
  std::int64_t baud = 9600;
  char parity = 'N';
  std::int64_t stopBits = 1;
  std::int64_t bits = 8;
  char flow = 'N';
};

struct SerialPort {
  std::string name;
  std::string module;  // empty: `device` is a terminal device, or tcp:HOST:PORT
  std::int64_t index = 0;  // of the module
  std::string device;
  LineSettings settings;
  std::string place, source;
};

struct SerialServer {
  std::string name, port;
  std::int64_t bufferSize = 0, queueSize = 0;  // 0: the default
  std::string endOfMessage;  // 0 to 2 bytes
  bool isCircular = true;
  std::string place, source;
};

class SerialLines {
 public:
  // Each returns false when the name is in use.
  bool addModule(SerialModule module);
  bool addPort(SerialPort port);
  // A further name of an existing port.
  bool addAlias(const std::string& name, const std::string& port);
  // Its port must have no server yet.
  void addServer(SerialServer server);

  // nullptr: nothing has this name.
  [[nodiscard]] const SerialModule* findModule(const std::string& name) const;
  [[nodiscard]] SerialPort* findPort(const std::string& portOrAlias);
  // The server of the port; nullptr: the port has none.
  [[nodiscard]] const SerialServer* serverOf(const std::string& portOrAlias) const;
  [[nodiscard]] const SerialPort* portOf(const std::string& module, std::int64_t index) const;
  [[nodiscard]] std::vector<std::string> portNames() const;

  // The processes of all ports that have a server.
  [[nodiscard]] std::vector<crate::Process> processes() const;

 private:
  [[nodiscard]] const std::string& portNamed(const std::string& portOrAlias) const;
  [[nodiscard]] crate::Process processOf(const SerialModule& module) const;
  [[nodiscard]] crate::Process processOf(const SerialPort& port) const;
  // Adds the server of a port, if it has one, to its process.
  void addServer(const std::string& port, const std::string& device, crate::Process& process) const;

  std::vector<SerialModule> modules_;
  std::vector<SerialPort> ports_;
  std::map<std::string, std::string> aliases_;  // to names of ports
  std::vector<SerialServer> servers_;  // of different ports
};

}  // namespace mpf::startup
