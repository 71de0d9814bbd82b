// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/served_port.h"

#include <fmt/format.h>
#include <utility>

#include "server/programs/serial_server/sniff_source.h"

namespace mpf {
namespace {

ServerOptions messagesOf(const SerialStartOptions& options, const SerialServerStart& start) {
  auto messages = options.arguments.messages;
  messages.queueSize = start.queueSize;
  return messages;
}

// The name of the program, with the name of the server when there are several.
std::string nameInLog(const SerialStartOptions& options, const SerialServerStart& start) {
  return options.servers.size() == 1 ? "mpf-serial-server"
                                     : fmt::format("mpf-serial-server {}", start.server);
}

}  // namespace

ServedPort::ServedPort(const Backplane& backplane, const SerialStartOptions& options,
                       const SerialServerStart& start, SerialPort& port)
    : portName_(start.port),
      port_(port),
      log_(nameInLog(options, start), options.arguments.logLevel),
      server_(backplane, start.server, messagesOf(options, start)),
      serial_(server_, port, start.serial, log_),
      sniff_(backplane, start.server, messagesOf(options, start), sniffSourceOf(port), log_) {
  logShortages(server_, *log_);
  port.onStateChange([this](SerialPortState state, const std::string& because) {
    if (state == SerialPortState::plugged) return log_->info("the line is connected");
    log_->warn("the line is lost: {}", because);
    server_.countAlarm();
  });
  log_->info(R"(serving {} ({}) as "{}" at location {}; listeners: "{}")", port.description(),
             options.describeLine(start.port), server_.getName(), server_.location(),
             sniff_.getName());
  if (port.state() == SerialPortState::unplugged)
    log_->warn("waiting for the line: {}", port.unpluggedBecause());
}

ServedPort::~ServedPort() {
  stop();
  join();
  port_.onStateChange({});
}

void ServedPort::start(std::function<void()> failed) {
  const auto serve = [this] {
    server_.run();
    log_->info("stopped");
  };
  thread_.start(log_, serve, failed);
  sniff_.start(std::move(failed));
}

}  // namespace mpf
