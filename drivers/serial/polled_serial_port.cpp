// SPDX-License-Identifier: MIT
#include "drivers/serial/polled_serial_port.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "base/signals_blocked.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf {
namespace {

void pollUntil(std::span<pollfd> entries, Deadline deadline) noexcept {
  const auto left = timespecOf(deadline.left());
  if (::ppoll(entries.data(), entries.size(), deadline.isNever() ? nullptr : &left, nullptr) >= 0)
    return;
  for (auto& entry : entries) entry.revents = 0;
}

void add(std::atomic<std::uint64_t>& counter, std::uint64_t n = 1) noexcept {
  counter.fetch_add(n, std::memory_order_relaxed);
}

std::uint64_t valueOf(const std::atomic<std::uint64_t>& counter) noexcept {
  return counter.load(std::memory_order_relaxed);
}

}  // namespace

PolledSerialPort::PolledSerialPort(std::unique_ptr<SerialLine> line, bool mayBeAbsent)
    : keeper_(std::move(line)) {
  {
    const SignalsBlocked blocked;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  if (mayBeAbsent) return;
  if (const auto problem = keeper_.waitForFirstAttempt(); !problem.empty())
    throw std::runtime_error(problem);
}

PolledSerialPort::~PolledSerialPort() = default;

// ---- callers' threads

void PolledSerialPort::bind(ByteHandler& handler) {
  bool isFree = false;
  tasks_.call([&] {
    isFree = handler_ == nullptr;
    if (isFree) handler_ = &handler;
  });
  if (!isFree)
    throw std::runtime_error(
        fmt::format("bind serial port {}: it is bound already", description()));
}

void PolledSerialPort::release() {
  tasks_.call([&] {
    end(SerialPortStatus::failure);
    handler_ = nullptr;
  });
}

SerialPortStatus PolledSerialPort::transfer(Bytes data, bool wantsRead, Deadline deadline) {
  Request request{.unsent = data, .awaitsAnswer = wantsRead, .deadline = deadline};
  request.awaitsIdleLine = !wantsRead && !deadline.hasPassed();
  return execute(request);
}

SerialPortStatus PolledSerialPort::sendBreak(Milliseconds duration) {
  Request request{.unsent = {}, .isBreak = true, .deadline = deadlineAfter(duration)};
  return execute(request);
}

SerialPortStatus PolledSerialPort::execute(Request& request) {
  std::function<void()> ask;
  if (isAbandoned_) {
    ask = [&] {
      if (isAbandoned_()) abandon(request);
    };
  }
  tasks_.callUntil(request.done, [&] { begin(request); }, ask);
  status_.store(request.status, std::memory_order_relaxed);
  return request.status;
}

void PolledSerialPort::abandon(const Request& request) {
  tasks_.call([&] {
    if (request_ == &request) end(SerialPortStatus::failure);
  });
}

SerialPortStatus PolledSerialPort::getStatus() const noexcept {
  return status_.load(std::memory_order_relaxed);
}

std::string PolledSerialPort::config(const SerialSettings& settings) {
  auto problem = problemOf(settings);
  if (!problem.empty()) return problem;
  tasks_.call([&] {
    problem = keeper_.isOpen()
                  ? keeper_.line().tryConfigure(settings)
                  : fmt::format("the settings did not change, because the line is unplugged: {}",
                                unpluggedBecause());
  });
  return problem;
}

SerialPortCounters PolledSerialPort::counters() const noexcept {
  return {.bytesIn = valueOf(counters_.bytesIn),
          .bytesOut = valueOf(counters_.bytesOut),
          .timeouts = valueOf(counters_.timeouts),
          .failures = valueOf(counters_.failures),
          .overruns = valueOf(counters_.overruns),
          .parityErrors = valueOf(counters_.parityErrors),
          .framingErrors = valueOf(counters_.framingErrors),
          .breaks = valueOf(counters_.breaks),
          .unplugs = valueOf(counters_.unplugs)};
}

// ---- the port's thread

void PolledSerialPort::run(const std::stop_token& stop) {
  const std::stop_callback wake(stop, [this] { tasks_.wake(); });
  while (!stop.stop_requested()) poll();
  end(SerialPortStatus::failure);
}

void PolledSerialPort::poll() {
  std::array<pollfd, 2> entries{pollfd{tasks_.descriptor(), POLLIN, 0}, keeper_.waitsFor()};
  auto& line = entries[1];
  if (keeper_.isOpen() && request_ != nullptr && !request_->unsent.empty()) line.events |= POLLOUT;
  pollUntil(entries, wakeAt());
  keeper_.service(line.revents);
  send();
  receive();
  advance();
  tasks_.runAll();
}

Deadline PolledSerialPort::wakeAt() const {
  auto next = keeper_.wakeAt();
  if (request_ == nullptr) return next;
  next = std::min(next, request_->deadline);
  if (request_->awaitsIdleLine && request_->unsent.empty())
    next = std::min(next, Deadline::after(keeper_.line().timeToSend()));
  return next;
}

void PolledSerialPort::begin(Request& request) {
  receiveAll();  // these bytes are older than the request
  if (handler_ == nullptr || request_ != nullptr || !keeper_.isOpen()) {
    add(counters_.failures);
    return tasks_.finish(request.done);
  }
  request_ = &request;
  if (request.isBreak && !keeper_.line().trySetBreak(true)) return end(SerialPortStatus::failure);
  if (request.awaitsAnswer) act(handler_->readBegins());
  send();
  receive();
  advance();
}

// Ends the request when it is complete or its deadline has passed.
void PolledSerialPort::advance() {
  if (request_ == nullptr) return;
  auto& request = *request_;
  if (request.awaitsIdleLine && request.unsent.empty())
    request.awaitsIdleLine = keeper_.line().timeToSend().count() > 0;
  const bool complete = request.unsent.empty() && !request.awaitsAnswer && !request.awaitsIdleLine;
  const bool late = request.deadline.hasPassed();
  if (request.isBreak ? late : complete) return end(SerialPortStatus::success);
  if (late) end(SerialPortStatus::timeout);
}

void PolledSerialPort::send() {
  while (request_ != nullptr && !request_->unsent.empty()) {
    const auto taken = keeper_.line().tryWrite(request_->unsent);
    if (!taken) return loseLine();
    if (*taken == 0) return;
    if (!std::exchange(request_->hasSent, true) && request_->awaitsAnswer) handler_->sendBegins();
    add(counters_.bytesOut, *taken);
    if (!taps().isEmpty()) {
      std::vector<LineByte> sent;
      for (const auto value : request_->unsent.first(*taken))
        sent.push_back({value, LineFault::none});
      show(ByteDirection::sent, sent);
    }
    request_->unsent = request_->unsent.subspan(*taken);
  }
}

void PolledSerialPort::receive() {
  if (!keeper_.isOpen()) return;
  received_.clear();
  const bool alive = keeper_.line().tryRead(received_);
  takeOverruns();
  if (!received_.empty()) {
    add(counters_.bytesIn, received_.size());
    show(ByteDirection::received, received_);
    for (const auto& byte : received_) deliver(byte);
  }
  if (!alive) loseLine();
}

// Receives all bytes that the kernel has. Stops after kMostReads, in case bytes arrive as fast as
// they are read.
void PolledSerialPort::receiveAll() {
  constexpr int kMostReads = 64;
  for (int reads = 0; reads < kMostReads && keeper_.isOpen(); ++reads) {
    receive();
    if (received_.empty()) return;
  }
}

// If no byte is marked as following a gap, the gap may be anywhere in the received bytes, and is
// reported before them.
void PolledSerialPort::takeOverruns() {
  const auto overruns = keeper_.line().takeOverruns();
  if (overruns == 0) return;
  add(counters_.overruns, overruns);
  const bool isPlaceKnown = std::ranges::any_of(received_, &LineByte::followsGap);
  if (isPlaceKnown) {
    unreportedOverruns_ += overruns;
  } else {
    fail(LineFault::overrun, overruns);
  }
}

void PolledSerialPort::deliver(const LineByte& byte) {
  if (byte.followsGap) fail(LineFault::overrun, std::exchange(unreportedOverruns_, 0));
  if (byte.fault != LineFault::none) {
    countFault(byte.fault);
    fail(byte.fault, 1);
  } else if (handler_ != nullptr) {
    act(handler_->byteReceived(byte.value));
  }
}

void PolledSerialPort::fail(LineFault fault, std::uint64_t count) {
  if (handler_ != nullptr) handler_->lineFailed(fault, count);
  act(ByteHandlerResult::error);
}

void PolledSerialPort::act(ByteHandlerResult result) {
  if (request_ == nullptr || !request_->awaitsAnswer || result == ByteHandlerResult::ok) return;
  if (result == ByteHandlerResult::endRead) return endRead(SerialPortStatus::success);
  end(SerialPortStatus::failure);
}

void PolledSerialPort::endRead(SerialPortStatus status) {
  if (std::exchange(request_->awaitsAnswer, false)) handler_->readEnds(status);
}

void PolledSerialPort::end(SerialPortStatus status) {
  if (request_ == nullptr) return;
  auto& line = keeper_.line();
  if (request_->isBreak) static_cast<void>(line.trySetBreak(false));
  if (status != SerialPortStatus::success && request_->hasSent) line.discardUnsent();
  if (status == SerialPortStatus::timeout) add(counters_.timeouts);
  if (status == SerialPortStatus::failure) add(counters_.failures);
  endRead(status);
  request_->status = status;
  tasks_.finish(std::exchange(request_, nullptr)->done);
}

void PolledSerialPort::loseLine() {
  add(counters_.unplugs);
  if (handler_ != nullptr) handler_->lineFailed(LineFault::unplugged, 1);
  keeper_.lose();
  end(SerialPortStatus::failure);
}

void PolledSerialPort::countFault(LineFault fault) {
  switch (fault) {
    case LineFault::none:
      break;
    case LineFault::parity:
      add(counters_.parityErrors);
      break;
    case LineFault::framing:
      add(counters_.framingErrors);
      break;
    case LineFault::breakSignal:
      add(counters_.breaks);
      break;
    case LineFault::overrun:  // counted by takeOverruns()
    case LineFault::unplugged:  // counted by loseLine()
      break;
  }
}

void PolledSerialPort::show(ByteDirection direction, std::span<const LineByte> bytes) const {
  if (taps().isEmpty()) return;
  const auto now = Clock::nowNs();
  std::vector<PeekedByte> peeked;
  for (const auto& byte : bytes) peeked.push_back({now, byte.value, direction, byte.fault});
  taps().show(peeked);
}

}  // namespace mpf
