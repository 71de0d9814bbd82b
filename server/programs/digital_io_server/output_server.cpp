// SPDX-License-Identifier: MIT
#include "server/programs/digital_io_server/output_server.h"

#include <utility>

#include "server/programs/hardware/bits_request.h"
#include "server/programs/hardware/other_types.h"

namespace mpf {

DigitalOutputServer::DigitalOutputServer(MessageServer& server, DigitalIo& io, const ServerLog& log)
    : io_(io), log_(log), faults_(server, log) {
  server.on<Int32>([this](Int32& request) { handle(request); });
  answerOtherTypes<Int32>(server, [this](MessageType type) {
    log_->debug("outputs: a request of type {}: status -1", toString(type));
  });
}

void DigitalOutputServer::handle(Int32& shared) {
  if (!std::exchange(isAsked_, true)) log_->info("first request for outputs");
  auto request = shared;  // a copy: the client can write to the request while we work
  request.status = 0;
  if (isReadRequest(request.cmd)) {
    const auto outputs = io_.tryReadOutputs();
    if (!outputs || !tryAnswerBits(request, request.cmd, *outputs)) request.status = -1;
    note(outputs ? DigitalIoStatus::success : DigitalIoStatus::gone, request);
  } else if (request.cmd == digital::cmdSetBits || request.cmd == digital::cmdClearBits ||
             request.cmd == digital::cmdWriteBits || request.cmd == digital::cmdSetDAC) {
    const auto status = perform(request);
    if (status != DigitalIoStatus::success) request.status = -1;
    note(status, request);
  } else {
    request.status = -1;
    log_->debug("outputs: unknown cmd {}: status -1", request.cmd);
  }
  shared = request;
}

DigitalIoStatus DigitalOutputServer::perform(const Int32& request) noexcept {
  const auto mask = static_cast<std::uint32_t>(request.address);
  switch (request.cmd) {
    case digital::cmdSetBits:
      return io_.trySetBits(mask);
    case digital::cmdClearBits:
      return io_.tryClearBits(mask);
    case digital::cmdWriteBits:
      return io_.tryWriteBits(mask, static_cast<std::uint32_t>(request.value));
    default:
      return io_.trySetThreshold(request.value);
  }
}

void DigitalOutputServer::note(DigitalIoStatus status, const Int32& request) {
  if (status == DigitalIoStatus::success) return faults_.success();
  if (isFault(status)) return faults_.fault(toString(status));
  log_->debug("outputs: cmd {}, mask {:#x}: {}", request.cmd,
              static_cast<std::uint32_t>(request.address), toString(status));
}

}  // namespace mpf
