// SPDX-License-Identifier: MIT
// mpf-serial-server: a server for each of several serial lines. The startup commands of the
// original MPF were
// initSerialServer("serverName","portName",bufSize,queueSize,"eomstr",circularBufferMode), and for
// ports of an octal UART before it
// initOctalUART("moduleName","carrierName","carrierSite",nports,intVec) and
// initOctalUARTPort("portName","moduleName",port,baud,"parity",stop_bits,bits_char,"flowType").
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <vector>

#include "base/run_main.h"
#include "base/stop_bell.h"
#include "server/programs/serial_server/serial_ports.h"
#include "server/programs/serial_server/served_port.h"
#include "server/programs/serial_server/start_options.h"

namespace {

int serve(int argc, char** argv) {
  mpf::SerialStartOptions options;
  if (const auto exit = options.parse(argc, argv)) return *exit;
  if (options.arguments.checkOnly) {
    for (const auto& uart : options.octal.uarts) options.hardware.check(uart.place);
    return 0;
  }
  const mpf::ServerLog log("mpf-serial-server", options.arguments.logLevel);
  mpf::SerialPorts ports(options, log);
  const auto backplane = mpf::Backplane::attach(options.arguments.backplane);
  mpf::StopBell stop;
  mpf::ProgramFailure failure;  // destroyed after the servers, whose threads use it
  std::vector<std::unique_ptr<mpf::ServedPort>> served;
  served.reserve(options.servers.size());
  for (const auto& start : options.servers)
    served.push_back(
        std::make_unique<mpf::ServedPort>(backplane, options, start, ports.find(start.port)));
  for (const auto& server : served) server->start([&] { failure.report(); });
  // Last: `ports` outlives the servers, also if the start of one throws.
  ports.onAlarm([&](const std::string& module) {
    for (const auto& server : served) {
      const auto* const port = options.octal.find(server->portName());
      if (port != nullptr && port->module == module) server->countAlarm();
    }
  });
  stop.wait();
  for (const auto& server : served) server->stop();
  for (const auto& server : served) server->join();
  ports.onAlarm({});
  return failure.exitStatus();
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf-serial-server", [&] { return serve(argc, argv); });
}
