// SPDX-License-Identifier: MIT
#include "server/programs/ip330_server/sweep_server.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include <mpf/ip330_commands.h>

#include "server/programs/hardware/other_types.h"

namespace mpf {
namespace {

void answer(MessageServer& server, Float64Message&& request, bool isGood) {
  request->status = isGood ? 0 : -1;
  static_cast<void>(server.reply(std::move(request)));
}

// Sends a reply with an array. Returns false when it is too large for a message of this server.
//   throws  std::bad_alloc
template <class Array, class Value>
[[nodiscard]] bool sendArray(MessageServer& server, const Float64Message& request,
                             std::span<const Value> values, bool isGood) {
  auto reply = server.allocReplyMessage<Array>(request, values.size());
  reply->cmd = request->cmd;
  reply->address = request->address;
  reply->extra = request->extra;
  reply->status = isGood ? 0 : -1;
  std::ranges::copy(values, reply.value().begin());
  const auto result = server.reply(std::move(reply));
  return result != ReplyResult::tooLarge && result != ReplyResult::noMemory;
}

// Calls `send`; replies with status -1 when it cannot send its reply.
template <class Send>
void answerBy(MessageServer& server, Float64Message&& request, Send send) {
  bool isSent = false;
  try {
    isSent = send(request);
  } catch (const std::bad_alloc&) {
    isSent = false;  // handled as a reply that is too large
  }
  if (!isSent) answer(server, std::move(request), false);
}

}  // namespace

Ip330SweepServer::Ip330SweepServer(MessageServer& server, Ip330& board, Ip330Sweep& sweep,
                                   const ServerLog& log)
    : server_(server), board_(board), sweep_(sweep) {
  server.on<Float64>([this](Float64Message&& request) { handle(std::move(request)); });
  answerOtherTypes<Float64>(server, [&log](MessageType type) {
    log->debug("sweep: a request of type {}: status -1", toString(type));
  });
}

void Ip330SweepServer::handle(Float64Message&& request) {
  const auto command = request->cmd;
  const auto value = request->value;
  if (command == ip330server::msgRead)
    return answerBy(server_, std::move(request), [this](auto& asked) { return sendPoints(asked); });
  if (command == ip330server::msgGetAcqStatus)
    return answerBy(server_, std::move(request), [this](auto& asked) { return sendStatus(asked); });
  answer(server_, std::move(request), tryDo(command, value));
}

bool Ip330SweepServer::sendPoints(const Float64Message& request) {
  const auto points = sweep_.tryRead(request->address);
  const auto values =
      points ? std::span<const std::int32_t>(*points) : std::span<const std::int32_t>();
  return sendArray<Int32Array>(server_, request, values, points.has_value());
}

bool Ip330SweepServer::sendStatus(const Float64Message& request) {
  const auto status = sweep_.status();
  const double seconds = status.elapsedSeconds;
  const std::array<double, 5> values{status.isAcquiring ? 1.0 : 0.0, seconds, seconds, 0,
                                     status.secondsPerPoint};
  return sendArray<Float64Array>(server_, request, std::span<const double>(values),
                                 board_.isDelivering());
}

bool Ip330SweepServer::tryDo(std::int32_t command, double value) {
  switch (command) {
    case ip330server::msgAcquire:
      sweep_.start();
      return true;
    case ip330server::msgStopAcquisition:
      sweep_.stop();
      return true;
    case ip330server::msgErase:
      sweep_.erase();
      return true;
    case ip330server::msgSetNChan:
      return sweep_.trySetPoints(value);
    case ip330server::msgSetDwell:
      return sweep_.trySetSecondsPerPoint(value);
    case ip330server::msgSetRealTime:
    case ip330server::msgSetLiveTime:
      return sweep_.trySetPreset(value);
    default:
      return command >= ip330server::msgAcquire && command <= ip330server::msgSetPscl;
  }
}

Ip330PidServer::Ip330PidServer(MessageServer& server, Ip330Pid& pid, const ServerLog& log)
    : server_(server), pid_(pid) {
  server.on<Float64>([this](Float64Message&& request) { handle(std::move(request)); });
  answerOtherTypes<Float64>(server, [&log](MessageType type) {
    log->debug("PID: a request of type {}: status -1", toString(type));
  });
}

void Ip330PidServer::handle(Float64Message&& request) {
  const auto command = request->cmd;
  const auto value = request->value;
  if (command == ip330server::cmdGetParams)
    return answerBy(server_, std::move(request), [this](auto& asked) { return sendParams(asked); });
  answer(server_, std::move(request), tryDo(command, value));
}

bool Ip330PidServer::sendParams(const Float64Message& request) {
  const auto status = pid_.status();
  std::array<double, ip330server::numFastPIDOffsets> values{};
  values[ip330server::offsetActual] = status.terms.actual;
  values[ip330server::offsetError] = status.terms.error;
  values[ip330server::offsetOutput] = status.terms.output;
  values[ip330server::offsetP] = status.terms.p;
  values[ip330server::offsetI] = status.terms.i;
  values[ip330server::offsetD] = status.terms.d;
  values[ip330server::offsetSecondsPerScan] = status.secondsPerScan;
  return sendArray<Float64Array>(server_, request, std::span<const double>(values), status.isGood);
}

bool Ip330PidServer::tryDo(std::int32_t command, double value) {
  if (command == ip330server::cmdStartFeedback) return pid_.start(), true;
  if (command == ip330server::cmdStopFeedback) return pid_.stop(), true;
  if (command == ip330server::cmdSetSecondsPerScan) return pid_.trySetSecondsPerScan(value);
  if (command < ip330server::cmdSetHighLimit || command > ip330server::cmdSetSetPoint ||
      !std::isfinite(value))
    return false;
  pid_.set([command, value](PidLoop& loop) {
    switch (command) {
      case ip330server::cmdSetHighLimit:
        loop.highLimit = value;
        break;
      case ip330server::cmdSetLowLimit:
        loop.lowLimit = value;
        break;
      case ip330server::cmdSetKP:
        loop.kp = value;
        break;
      case ip330server::cmdSetKI:
        loop.ki = value;
        break;
      case ip330server::cmdSetKD:
        loop.kd = value;
        break;
      case ip330server::cmdSetI:
        loop.setI(value);
        break;
      default:
        loop.setPoint = value;
    }
  });
  return true;
}

}  // namespace mpf
