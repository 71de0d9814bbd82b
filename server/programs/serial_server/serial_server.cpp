// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/serial_server.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <utility>

#include <mpf/serial_commands.h>

#include "base/time_text.h"
#include "server/programs/hardware/other_types.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): all constants of <mpf/serial_commands.h>
using namespace serial;

// A client may exit right after a write: the write continues for this time.
constexpr std::chrono::seconds kGraceOfWrites{2};

std::int32_t commandOf(const Char8Array& request) { return request.cmd & cmdCommandMask; }

std::size_t maxBytesOf(const Char8Array& request) {
  return static_cast<std::size_t>(std::max(request.extra, 0));
}

// A timeout of 0 returns the bytes that have been received, without waiting.
std::chrono::milliseconds timeoutOf(const Char8Array& request) {
  const auto timeout = std::max(request.timeout, 0);
  if ((request.cmd & cmdTimeoutMilliseconds) != 0) return std::chrono::milliseconds(timeout);
  return std::chrono::seconds(timeout);
}

constexpr std::int32_t kOptions =
    cmdFlush | cmdStartCircularBuffer | cmdStopCircularBuffer | cmdSetEom | cmdTimeoutMilliseconds;

// What is wrong with `cmd`; empty when nothing is.
std::string problemOf(const Char8Array& request) {
  const auto command = commandOf(request);
  if (command != cmdRead && command != cmdWrite && command != cmdWriteRead)
    return fmt::format(
        "cmd {:#x} has no command: use 1 (read), 2 (write) or 3 (write-read), plus options",
        request.cmd);
  const auto unknown = request.cmd & ~(cmdCommandMask | kOptions);
  if (unknown == 0) return {};
  return fmt::format("cmd {:#x} has unknown options: {:#x}; the options are {:#x}", request.cmd,
                     static_cast<std::uint32_t>(unknown), kOptions);
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

SerialServer::SerialServer(MessageServer& server, SerialPort& port,
                           const SerialServerOptions& options, const ServerLog& log)
    : server_(server),
      log_(log),
      limits_(options.limits),
      faults_(server, port, log),
      reader_(
          options.bufferBytes, options.eom, options.circularBuffer, options.limits,
          [this] { noteSurplus(); }, [this] { faults_.look(); }),
      port_(port, reader_) {
  server.on<Char8Array>([this](Char8ArrayMessage&& request) { handle(std::move(request)); });
  server.on<SerialConfig>([this](SerialConfigMessage&& request) { configure(std::move(request)); });
  answerOtherTypes<Char8Array, SerialConfig>(server, [this](MessageType type) {
    log_->debug("a request of type {}: status -1", toString(type));
  });
}

void SerialServer::stop() {
  isStopped_.store(true, std::memory_order_relaxed);
  // Before the request in progress ends: the server must not receive another.
  server_.interrupt();
  port_->release();
}

// ---- the log

void SerialServer::noteRequest() {
  if (!std::exchange(isAsked_, true)) log_->info("first request");
}

void SerialServer::noteStatus(const Work& work) {
  log_->debug("cmd {:#x}, timeout {}: status {}", work.fields.cmd, work.fields.timeout,
              work.status);
  faults_.look();
  // `faults_` reports the faults of the line.
  const bool fails = work.status == serialServerStatusError && !faults_.hasAnswerFaults();
  if (fails == std::exchange(isFailing_, fails)) return;
  if (!fails) return log_->info("requests succeed again");
  log_->warn("requests fail: {}", whyFailed(work));
}

std::string SerialServer::whyFailed(const Work& work) const {
  if (!work.problem.empty()) return work.problem;
  if (auto because = port_->unpluggedBecause(); !because.empty()) return because;
  return "the line was lost for a while, and works again";
}

void SerialServer::noteSurplus() {
  server_.countAlarm();
  log_->warn(
      "surplus input: bytes arrived outside of requests; the next request waits until the line is "
      "silent");
}

void SerialServer::noteLimits(const Char8Array& request) {
  if (timeoutOf(request) <= limits_.maxTimeout && request.numberRetrys <= limits_.maxRetries)
    return;
  log_->warn(
      "a request is limited to {} (--max-timeout) and {} retries (--max-retries): cmd {:#x}, "
      "timeout {}, numberRetrys {}",
      timeText(limits_.maxTimeout), limits_.maxRetries, request.cmd, request.timeout,
      request.numberRetrys);
}

// ---- requests

void SerialServer::applyOptions(const Char8Array& request) {
  if ((request.cmd & cmdStartCircularBuffer) != 0) reader_.setCircular(true);
  if ((request.cmd & cmdStopCircularBuffer) != 0) reader_.setCircular(false);
  // Old clients send a length of 3 for a string of 2: the first two bytes count.
  if ((request.cmd & cmdSetEom) != 0) reader_.setEom(std::string(request.eom().substr(0, 2)));
}

// Copies the request, because the client can write to it at any time.
SerialServer::Work SerialServer::workOf(const Char8ArrayMessage& request) {
  Work work{.fields = *request, .data = {request.value().begin(), request.value().end()}};
  work.until = Deadline::after(limits_.maxTimeout);
  work.retries = std::clamp(work.fields.numberRetrys, 0, limits_.maxRetries);
  return work;
}

void SerialServer::handle(Char8ArrayMessage&& request) {
  noteRequest();
  auto work = workOf(request);
  faults_.setAnswer(0);
  work.problem = problemOf(work.fields);
  if (work.problem.empty()) perform(request, work);
  else work.status = serialServerStatusError;
  if (work.status == serialServerStatusError && !server_.isClientConnected(request)) {
    log_->info("a client disconnected during its request (cmd {:#x})", work.fields.cmd);
  } else if (!isStopped_.load(std::memory_order_relaxed)) {
    noteStatus(work);
  }
  reply(request, work);
}

void SerialServer::perform(const Char8ArrayMessage& request, Work& work) {
  noteLimits(work.fields);
  applyOptions(work.fields);
  writeEnds_ = Deadline::never();
  const bool isWrite = commandOf(work.fields) == cmdWrite;
  work.isAbandoned = [this, &request, isWrite] { return isAbandoned(request, isWrite); };
  port_->abandonWhen(work.isAbandoned);
  serve(work);
  port_->abandonWhen({});
}

void SerialServer::reply(const Char8ArrayMessage& request, const Work& work) {
  auto reply = server_.allocReplyMessage<Char8Array>(request, work.answer.size());
  *reply = work.fields;
  reply.setSize(work.answer.size());
  std::copy(work.answer.begin(), work.answer.end(), reply.value().begin());
  reply->status = work.status;
  faults_.describe(*reply);
  static_cast<void>(server_.reply(std::move(reply)));
}

bool SerialServer::isAbandoned(const Char8ArrayMessage& request, bool isWrite) {
  if (isStopped_.load(std::memory_order_relaxed) || port_->state() == SerialPortState::unplugged)
    return true;
  if (server_.isClientConnected(request)) return false;
  if (!isWrite) return true;
  if (writeEnds_.isNever()) writeEnds_ = Deadline::after(kGraceOfWrites);
  return writeEnds_.hasPassed();
}

void SerialServer::serve(Work& work) {
  const bool isWriteRead = commandOf(work.fields) == cmdWriteRead && !work.data.empty();
  const bool isRead = commandOf(work.fields) != cmdWrite && !isWriteRead;
  for (;;) {
    attempt(work);
    if (work.status == serialServerStatusOK || work.retries == 0 || work.isAbandoned()) return;
    if (work.status == serialServerStatusTimeout && isWriteRead) takeLateAnswer(work);
    if (work.status == serialServerStatusOK || work.until.hasPassed()) return;
    --work.retries;
    // A read is repeated only after a timeout: otherwise bytes of its answer are gone, and another
    // read would return the rest with status 0.
    work.continues =
        isRead && work.status == serialServerStatusTimeout && reader_.tryContinue(work.retries > 0);
    if (isRead && !work.continues) return;
  }
}

void SerialServer::attempt(Work& work) {
  faults_.setAnswer(0);
  switch (commandOf(work.fields)) {
    case cmdRead:
      return read(work, (work.fields.cmd & cmdFlush) != 0);
    case cmdWrite:
      return write(work);
    default:
      return ask(work);
  }
}

Deadline SerialServer::deadlineOf(const Work& work) const {
  return std::min(work.until, Deadline::after(std::min<std::chrono::milliseconds>(
                                  timeoutOf(work.fields), limits_.maxTimeout)));
}

void SerialServer::read(Work& work, bool flush) {
  if (!work.continues) reader_.prepareRead(flush, maxBytesOf(work.fields), work.retries > 0);
  takeAnswer(work, port_->read(deadlineOf(work)));
}

void SerialServer::write(Work& work) {
  if (!isInStep(work, false, Deadline::after(limits_.longestSync()))) return;
  if ((work.fields.cmd & cmdFlush) != 0) flush();
  work.status = statusOf(port_->write(work.data, deadlineOf(work)));
  reader_.noteWritten();
}

// The bytes of a read that ends at once: those that the port had not passed on before are included.
void SerialServer::flush() {
  reader_.prepareRead(true, 0, false);
  static_cast<void>(port_->read(Deadline::after({})));
  static_cast<void>(reader_.takeAnswer());
}

void SerialServer::ask(Work& work) {
  // Nothing to send: reads the bytes that arrive from now on.
  if (work.data.empty()) return read(work, true);
  const auto until = Deadline::after(limits_.longestSync());
  while (isInStep(work, true, until)) {
    reader_.prepareQuestion(maxBytesOf(work.fields), work.retries > 0);
    if (takeAnswer(work, port_->writeRead(work.data, deadlineOf(work)))) return;
    if (work.isAbandoned()) return;
  }
}

// Reads on after a timeout: an answer that is late for its request can serve as that of the retry.
void SerialServer::takeLateAnswer(Work& work) {
  if (!reader_.tryContinue(false)) return;
  takeAnswer(work, port_->read(std::min(work.until, Deadline::after(limits_.resyncLimit))));
}

bool SerialServer::takeAnswer(Work& work, SerialPortStatus status) {
  auto read = reader_.takeAnswer();
  work.answer = std::move(read.bytes);
  faults_.setAnswer(read.faults);
  work.status = faults_.statusOf(read.overflow ? serialServerStatusOverflow : statusOf(status));
  work.problem.clear();
  return !read.wasDisturbed;
}

bool SerialServer::isInStep(Work& work, bool isQuestion, Deadline until) {
  const auto sync =
      reader_.waitUntilSynchronized(isQuestion, std::min(until, work.until), work.isAbandoned);
  if (sync == LineReader::Sync::synchronized) return true;
  work.status = serialServerStatusError;
  work.answer.clear();
  if (sync == LineReader::Sync::noSilence)
    work.problem = fmt::format(
        "the request was not sent, because input does not stop: the line was never silent for {} "
        "ms (--quiet-time), so an answer could not be matched to its request",
        limits_.quietTime.count());
  return false;
}

void SerialServer::configure(SerialConfigMessage&& request) {
  noteRequest();
  const auto refusal = port_->config({request->baud, request->stopBits, request->bitsPerChar,
                                      request->parity, request->flowControl});
  if (!refusal.empty()) log_->warn("settings refused: {}", refusal);
  auto reply = server_.allocReplyMessage<Int32>(request);
  reply->status = refusal.empty() ? serialServerStatusOK : serialServerStatusError;
  static_cast<void>(server_.reply(std::move(reply)));
}

}  // namespace mpf
