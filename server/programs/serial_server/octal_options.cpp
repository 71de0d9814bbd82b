// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/octal_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "server/programs/hardware/option_fields.h"

namespace mpf {
namespace {

constexpr const char* kUartForm = "MODULE,CARRIER,SITE,NPORTS[,VECTOR]";
constexpr const char* kPortForm = "PORT,MODULE,N[,BAUD[,PARITY[,STOPBITS[,BITS[,FLOW]]]]]";

OctalUartStart readUart(OptionFields& fields) {
  OctalUartStart uart;
  uart.place.name = fields.word("module");
  uart.place.carrier = fields.word("carrier");
  uart.place.site = fields.word("site");
  uart.ports = fields.number("number of ports");
  const int vector = fields.number("vector", -1);
  if (vector != -1) uart.vector = vector;
  return uart;
}

OctalPortStart readPort(OptionFields& fields) {
  OctalPortStart port;
  port.name = fields.word("port");
  port.module = fields.word("module");
  port.number = fields.number("number of the port");
  auto& settings = port.settings;
  settings.baud = fields.number("baud rate", settings.baud);
  settings.parity = fields.letter("parity", settings.parity);
  settings.stopBits = fields.number("stop bits", settings.stopBits);
  settings.bitsPerChar = fields.number("bits per character", settings.bitsPerChar);
  settings.flowControl = fields.letter("flow control", settings.flowControl);
  return port;
}

}  // namespace

void OctalOptions::addTo(CLI::App& app) {
  addFields(app, "--octal-uart", kUartForm,
            "A module of serial ports; one process must serve all its ports",
            [this](OptionFields& fields) { uarts.push_back(readUart(fields)); });
  addFields(app, "--octal-port", kPortForm,
            "A port of such a module, to be used as PORT; default settings: 9600,N,1,8,N",
            [this](OptionFields& fields) { ports.push_back(readPort(fields)); });
  app.add_option_function<std::string>(
         "--octal-model",
         [this](const std::string& kind) {
           model.model = kind == "232" ? 0x22 : kind == "422" ? 0x2a : 0x48;
         },
         "On a model carrier: the kind of the module")
      ->check(CLI::IsMember({"232", "422", "485"}))
      ->default_str("232");
  app.add_flag_callback(
      "--octal-timing", [this] { model.time = OctalUartModelTime::clock; },
      "On a model carrier: bytes take as long as on a real line, and may get lost");
}

const OctalPortStart* OctalOptions::find(const std::string& port) const {
  const auto found = std::ranges::find(ports, port, &OctalPortStart::name);
  return found == ports.end() ? nullptr : &*found;
}

const OctalUartStart* OctalOptions::findUart(const std::string& module) const {
  const auto found =
      std::ranges::find(uarts, module, [](const OctalUartStart& uart) { return uart.place.name; });
  return found == uarts.end() ? nullptr : &*found;
}

}  // namespace mpf
