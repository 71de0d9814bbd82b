// SPDX-License-Identifier: MIT
#include <mpf/server/programs/serial_server/serial_server.h>

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <utility>
#include <vector>

#include <mpf/schema/serial_server.h>
#include <mpf/server/programs/hardware/other_types.h>

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the manual's words, all of them
using namespace serial;

// A timeout of 0 gives at once what is there.
std::chrono::milliseconds timeoutOf(const Char8Array& request) {
  const auto timeout = std::max(request.timeout, 0);
  if ((request.cmd & cmdTimeoutMilliseconds) != 0) return std::chrono::milliseconds(timeout);
  return std::chrono::seconds(timeout);
}

std::int32_t statusOf(SerialPortStatus status) {
  switch (status) {
    case SerialPortStatus::success:
      return serialServerStatusOK;
    case SerialPortStatus::timeout:
      return serialServerStatusTimeout;
    case SerialPortStatus::failure:
      return serialServerStatusError;
  }
  return serialServerStatusError;
}

}  // namespace

SerialServer::SerialServer(MessageServer& server, SerialPort& port, const SerialServerOptions& options, const ServerLog& log)
    : server_(server),
      log_(log),
      faults_(server, port, log),
      reader_(options.bufferBytes, options.eom, options.circularBuffer, [this] { faults_.look(); }),
      port_(port, reader_) {
  server.on<Char8Array>([this](Char8ArrayMessage&& request) { handle(std::move(request)); });
  server.on<SerialConfig>([this](SerialConfigMessage&& request) { configure(std::move(request)); });
  answerOtherTypes<Char8Array, SerialConfig>(server,
                                             [this](MessageType type) { log_->debug("a request of type {}: status -1", toString(type)); });
}

void SerialServer::stop() {
  isStopped_.store(true, std::memory_order_relaxed);
  server_.interrupt();  // before the request that is on the line ends: the server shall take no other
  port_->release();
}

void SerialServer::noteRequest() {
  if (!std::exchange(isAsked_, true)) log_->info("the first client asks");
}

void SerialServer::noteStatus(const Char8Array& request, std::int32_t status) {
  log_->debug("cmd {:#x}, timeout {}: status {}", request.cmd, request.timeout, status);
  faults_.look();
  const bool fails = status == serialServerStatusError && !faults_.hasAnswerFaults();  // of faults of the line `faults_` tells
  if (fails == std::exchange(isFailing_, fails)) return;
  if (!fails) return log_->info("requests succeed again");
  log_->warn("requests fail: {}", whyFailed(request));
}

std::string SerialServer::whyFailed(const Char8Array& request) const {
  if (auto because = port_->unpluggedBecause(); !because.empty()) return because;
  const auto command = request.cmd & cmdCommandMask;
  if (command == cmdRead || command == cmdWrite || command == cmdWriteRead) return "the line was lost, and is there again";
  return fmt::format("cmd {:#x} has none of the commands 1 (read), 2 (write) and 3 (write and read)", request.cmd);
}

void SerialServer::applyOptions(const Char8Array& request) {
  if ((request.cmd & cmdStartCircularBuffer) != 0) reader_.setCircular(true);
  if ((request.cmd & cmdStopCircularBuffer) != 0) reader_.setCircular(false);
  // Old clients send a length of 3 for a string of 2: the first two bytes count.
  if ((request.cmd & cmdSetEom) != 0) reader_.setEom(std::string(request.eom().substr(0, 2)));
}

std::int32_t SerialServer::attempt(const Char8Array& request, SerialPort::Bytes data, std::string& answer) {
  faults_.setAnswer(0);
  const auto timeout = timeoutOf(request);
  const auto command = request.cmd & cmdCommandMask;
  if (command == cmdWrite) return statusOf(port_->write(data, timeout));
  reader_.prepare((request.cmd & cmdFlush) != 0, static_cast<std::size_t>(std::max(request.extra, 0)));
  SerialPortStatus status{};
  if (command == cmdRead) {
    status = port_->read(timeout);
  } else if (command == cmdWriteRead) {
    status = port_->writeRead(data, timeout);
  } else {
    return serialServerStatusError;  // options alone do no I/O, and are no command
  }
  auto read = reader_.takeAnswer();
  answer = std::move(read.bytes);
  faults_.setAnswer(read.faults);
  return faults_.statusOf(read.overflow ? serialServerStatusOverflow : statusOf(status));
}

void SerialServer::handle(Char8ArrayMessage&& request) {
  noteRequest();
  const auto fields = *request;  // a copy: the client can write to the request while we work
  const std::vector<std::uint8_t> data(request.value().begin(), request.value().end());
  applyOptions(fields);
  std::string answer;
  auto status = attempt(fields, data, answer);
  for (auto retries = fields.numberRetrys; status != serialServerStatusOK && retries > 0 && !isStopped_.load(std::memory_order_relaxed);
       --retries) {
    status = attempt(fields, data, answer);
  }
  if (!isStopped_.load(std::memory_order_relaxed)) noteStatus(fields, status);
  auto reply = server_.allocReplyMessage<Char8Array>(request, answer.size());
  *reply = fields;
  reply.setSize(answer.size());
  std::copy(answer.begin(), answer.end(), reply.value().begin());
  reply->status = status;
  faults_.describe(*reply);
  static_cast<void>(server_.reply(std::move(reply)));
}

void SerialServer::configure(SerialConfigMessage&& request) {
  noteRequest();
  const auto refusal = port_->config({request->baud, request->stopBits, request->bitsPerChar, request->parity, request->flowControl});
  if (!refusal.empty()) log_->warn("settings refused: {}", refusal);
  auto reply = server_.allocReplyMessage<Int32>(request);
  reply->status = refusal.empty() ? serialServerStatusOK : serialServerStatusError;
  static_cast<void>(server_.reply(std::move(reply)));
}

}  // namespace mpf
