// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/serial_ports.h"

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/serial/posix_terminal.h>
#include <mpf/drivers/serial/tcp_serial_port.h>

#include "drivers/octal_uart/octal_uart_line.h"
#include "drivers/octal_uart/octal_uart_port.h"
#include "drivers/serial/late_line.h"
#include "drivers/serial/polled_serial_port.h"

namespace mpf {

SerialPorts::SerialPorts(SerialStartOptions& options, const ServerLog& log)
    : options_(options), log_(log) {
  for (const auto& uart : options.octal.uarts) {
    if (tryOpenModule(uart)) openUart(uart);
  }
  for (const auto& start : options.servers)
    registry_.registerName(start.port, openPort(start.port));
}

// ---- modules

// Returns false when the module is missing and --wait waits for it.
bool SerialPorts::tryOpenModule(const OctalUartStart& start) {
  try {
    openModule(start);
    return true;
  } catch (const std::runtime_error& error) {
    if (!options_.hardware.waits() || Hardware::isPermanent(error)) throw;
    log_->warn("waiting for the board: {}", error.what());
    return false;
  }
}

bool SerialPorts::hasModule(const std::string& name) {
  const std::lock_guard lock(mutex_);
  return options_.hardware.modules().find(name) != nullptr;
}

IndustryPackModule& SerialPorts::openModule(const OctalUartStart& start) {
  const OctalUartModel* model = nullptr;
  const auto makeModel = [&] {
    auto made = std::make_unique<OctalUartModel>(options_.octal.model);
    model = made.get();
    return made;
  };
  auto& module = options_.hardware.openNow(start.place, kOctalUart, makeModel, log_);
  for (const auto& port : options_.octal.ports) {
    if (model != nullptr && port.module == start.place.name && port.number >= 0 &&
        port.number < start.ports)
      log_->info("{} is a model: its instrument may open {}", port.name,
                 model->terminal(port.number));
  }
  return module;
}

OctalUart& SerialPorts::openUart(const OctalUartStart& start) {
  const auto& name = start.place.name;
  const std::lock_guard lock(mutex_);
  if (const auto found = uarts_.find(name); found != uarts_.end()) return *found->second;
  auto& modules = options_.hardware.modules();
  auto* const known = modules.find(name);
  auto& module = known != nullptr ? *known : openModule(start);
  if (start.vector) modules.takeVector(*start.vector, module);
  options_.hardware.logPriority(log_);
  auto uart = std::make_unique<OctalUart>(
      module, OctalUartOptions{.ports = start.ports, .vector = start.vector.value_or(0)});
  if (alarmHandler_) follow(*uart, name);
  return *uarts_.emplace(name, std::move(uart)).first->second;
}

void SerialPorts::onAlarm(AlarmHandler handler) {
  const std::lock_guard lock(mutex_);
  alarmHandler_ = std::move(handler);
  for (const auto& [name, uart] : uarts_) follow(*uart, name);
}

void SerialPorts::follow(OctalUart& uart, const std::string& module) const {
  uart.onAlarm([&log = log_, handler = alarmHandler_, module](OctalUartAlarm alarm,
                                                              const std::string& what) {
    log->warn("{}", what);
    if (handler && alarm != OctalUartAlarm::lost) handler(module);
  });
}

// ---- ports

std::shared_ptr<SerialPort> SerialPorts::openPort(const std::string& port) {
  if (const auto* const start = options_.octal.find(port)) return openOctalPort(*start);
  try {
    return openLine(port);
  } catch (const std::runtime_error& error) {
    if (options_.hardware.waits()) throw;
    throw std::runtime_error(fmt::format("{}; --wait waits for it", error.what()));
  }
}

std::shared_ptr<SerialPort> SerialPorts::openLine(const std::string& port) {
  const bool waits = options_.hardware.waits();
  if (const auto address = tcpAddressOf(port)) {
    TcpSerialOptions tcp;
    tcp.address = TcpAddress::parse(*address);
    tcp.waitForServer = waits;
    return openTcpSerialPort(tcp);
  }
  PosixTerminalOptions terminal;
  terminal.device = port;
  terminal.settings = options_.settings;
  terminal.waitForDevice = waits;
  return openPosixTerminal(terminal);
}

std::shared_ptr<SerialPort> SerialPorts::openOctalPort(const OctalPortStart& start) {
  const auto& uart = *options_.octal.findUart(start.module);
  if (!hasModule(start.module)) return openLater(start, uart);
  OctalUartPortOptions octal;
  octal.settings = start.settings;
  octal.waitForModule = options_.hardware.waits();
  return openOctalUartPort(openUart(uart), start.number, octal);
}

// Reports errors of the command line now, since a module that appears later cannot mend them.
std::shared_ptr<SerialPort> SerialPorts::openLater(const OctalPortStart& port,
                                                   const OctalUartStart& uart) {
  auto description = fmt::format("port {} of {} (carrier {}, site {})", port.number, port.module,
                                 uart.place.carrier, uart.place.site);
  if (port.number < 0 || port.number >= uart.ports)
    throw std::invalid_argument(
        fmt::format("{}: the module has ports 0 to {}", description, uart.ports - 1));
  if (const auto refused = octalUartProblemOf(port.settings, false); !refused.empty())
    throw std::invalid_argument(fmt::format("{}: {}", description, refused));
  auto line = std::make_unique<LateLine>(std::move(description), [this, &port, &uart] {
    return std::make_unique<OctalUartLine>(openUart(uart), port.number, port.settings);
  });
  return std::make_shared<PolledSerialPort>(std::move(line), true);
}

}  // namespace mpf
