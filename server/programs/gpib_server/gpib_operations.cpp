// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/gpib_operations.h"

#include <utility>

#include <mpf/gpib_commands.h>

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): most constants of <mpf/gpib_commands.h>
using namespace gpib;

GpibReply replyOf(const GpibRequest& request, GpibResult&& result) {
  return {statusOf(result.status), request.extra, {}, std::move(result.reason)};
}

GpibReply replyOf(const GpibRequest& request, GpibReadResult&& result) {
  GpibReply reply{statusOf(result.status), 0, std::move(result.data), std::move(result.reason)};
  if (!result.ok()) return reply;
  const auto end = request.limits.endOfString;
  if (result.sawEnd) {
    reply.extra = gpibReadEndedByEnd;
  } else if (end && !reply.value.empty() && reply.value.back() == *end) {
    reply.extra = gpibReadEndedByString;
  } else {
    reply.extra = gpibReadEndedByCount;
    if (!request.isCountRequested) reply.status = gpibStatusOverflow;
  }
  return reply;
}

GpibReply replyOf(const GpibRequest& request, GpibPollResult&& result) {
  auto reply = replyOf(request, static_cast<GpibResult&&>(result));
  if (reply.status == gpibStatusOK) reply.value = {result.statusByte};
  return reply;
}

GpibReply clear(GpibBus& bus, const GpibRequest& request, GpibUser user) {
  const auto& at = request.addresses;
  return replyOf(request, at.empty() ? bus.clearAll(request.until, user)
                                     : bus.clear(at.front(), request.until, user));
}

GpibReply lease(GpibBus& bus, const GpibRequest& request, GpibUser user) {
  std::string name(request.data.begin(), request.data.end());
  if (name.empty()) name = "client " + std::to_string(user);
  auto reply = replyOf(request, bus.lease(user, std::move(name), request.lease, request.until));
  if (reply.status == gpibStatusOK) reply.extra = static_cast<std::int32_t>(request.lease.count());
  return reply;
}

}  // namespace

std::int32_t statusOf(GpibStatus status) noexcept {
  switch (status) {
    case GpibStatus::success:
      return gpibStatusOK;
    case GpibStatus::timeout:
      return gpibStatusTimeout;
    case GpibStatus::noListener:
      return gpibStatusNoListener;
    case GpibStatus::failure:
      return gpibStatusError;
    case GpibStatus::unsupported:
      return gpibStatusUnsupported;
    case GpibStatus::leased:
      return gpibStatusLeased;
  }
  return gpibStatusError;
}

GpibReply performGpib(GpibBus& bus, const GpibRequest& request, GpibUser user) {
  const auto& at = request.addresses;
  const auto& data = request.data;
  const auto until = request.until;
  switch (request.command) {
    case cmdRead:
      return replyOf(request, bus.read(at.front(), request.limits, until, user));
    case cmdWrite:
      return replyOf(request, bus.write(at.front(), data, until, user, request.sendEnd));
    case cmdWriteRead:
      return replyOf(request, bus.writeRead(at.front(), data, request.limits, until, user));
    case cmdSerialPoll:
      return replyOf(request, bus.serialPoll(at.front(), until, user));
    case cmdClear:
      return clear(bus, request, user);
    case cmdTrigger:
      return replyOf(request, bus.trigger(at, until, user));
    case cmdInterfaceClear:
      return replyOf(request, bus.interfaceClear(until, user));
    case cmdRemoteEnable:
      return replyOf(request, bus.remoteEnable(request.extra == 1, until, user));
    case cmdLocalLockout:
      return replyOf(request, bus.localLockout(until, user));
    case cmdGoToLocal:
      return replyOf(request, bus.goToLocal(at.front(), until, user));
    case cmdSendCommands:
      return replyOf(request, bus.sendCommands(data, until, user));
    case cmdLease:
      return lease(bus, request, user);
    case cmdUnlease:
      bus.release(user);
      return replyOf(request, GpibResult{});
    default:
      return {gpibStatusInvalid, request.extra, {}, "the command is not one of the bus"};
  }
}

}  // namespace mpf
