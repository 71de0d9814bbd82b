// SPDX-License-Identifier: MIT
#include "server/programs/ip330_server/scan_server.h"

#include <cmath>
#include <stdexcept>

#include <mpf/ip330_commands.h>

#include "server/programs/hardware/other_types.h"

namespace mpf {

Ip330ScanServer::Ip330ScanServer(MessageServer& server, Ip330Scan& scan,
                                 std::chrono::milliseconds average, const ServerLog& log)
    : scan_(scan), average_(average), log_(log) {
  server.on<Int32>([this](Int32& request) { handle(request); });
  answerOtherTypes<Int32>(server, [this](MessageType type) {
    log_->debug("scan: a request of type {}: status -1", toString(type));
  });
}

void Ip330ScanServer::handle(Int32& request) {
  const auto fields = request;  // once: the client can write to the request while we work
  const auto average = fields.extra != 0 ? std::chrono::milliseconds(fields.extra) : average_;
  const auto value = scan_.tryRead(fields.address, fields.value, average);
  request.status = value ? 0 : -1;
  if (value) request.value = *value;
  if (!value)
    log_->debug("scan: channel {}, gain {}, {} ms: status -1", fields.address, fields.value,
                average.count());
}

Ip330ConfigServer::Ip330ConfigServer(MessageServer& server, Ip330& board, const ServerLog& log)
    : board_(board), log_(log) {
  server.on<Int32>([this](Int32& request) {
    const auto command = request.cmd;
    request.status = tryDo(command, request) ? 0 : -1;
    log_->info("config: cmd {}, value {}: status {}", command, request.value, request.status);
  });
  answerOtherTypes<Int32>(server, [this](MessageType type) {
    log_->debug("config: a request of type {}: status -1", toString(type));
  });
}

bool Ip330ConfigServer::tryDo(std::int32_t command, Int32& request) {
  const auto settings = board_.settings();
  switch (command) {
    case ip330server::cmdSetSecondsBetweenCalibrate:
      return board_.trySetSecondsBetweenCalibrate(request.value);
    case ip330server::cmdCalibrate:
      return board_.tryCalibrate();
    case ip330server::cmdSetScanMode:
      try {
        return tryConfigure(parseIp330ScanMode(request.value), settings.microsecondsPerScan);
      } catch (const std::invalid_argument& error) {
        log_->warn("config: {}", error.what());
        return false;
      }
    case ip330server::cmdSetMicrosecondsPerScan:
      if (!tryConfigure(settings.scanMode, request.value)) return false;
      request.value = static_cast<std::int32_t>(std::lround(board_.microsecondsPerScan()));
      return true;
    case ip330server::cmdStartConvert:
      return board_.tryStartConvert();
    default:
      return false;
  }
}

bool Ip330ConfigServer::tryConfigure(Ip330ScanMode mode, double microsecondsPerScan) {
  const auto problem = board_.tryConfigure(mode, board_.settings().trigger, microsecondsPerScan);
  if (!problem.empty()) log_->warn("config: {}", problem);
  return problem.empty();
}

}  // namespace mpf
