// SPDX-License-Identifier: MIT
#include "epics/devices/string_parm/text_device.h"

#include <alarm.h>
#include <recGbl.h>

namespace mpf {
namespace {

// A server that is alive replies to each request; requests of other records come first.
constexpr std::chrono::seconds kQueueTime{60};
constexpr std::size_t kMaxEom = 4;

}  // namespace

long TextDevice::sendText(const TextRequest& request) {
  auto message = Char8ArrayMessage::allocValue(request.text.size());
  std::copy(request.text.begin(), request.text.end(), message.value().begin());
  message->cmd = request.cmd;
  message->extra = request.maxBytes;
  message->address = request.address;
  // Whole seconds are sent as seconds, which every server understands.
  const auto milliseconds = request.timeout.count();
  const bool isSeconds = milliseconds % 1000 == 0;
  message->timeout = static_cast<std::int32_t>(isSeconds ? milliseconds / 1000 : milliseconds);
  if (!isSeconds) message->cmd |= serial::cmdTimeoutMilliseconds;
  if (request.eom) {
    const auto eom = request.eom->substr(0, kMaxEom);
    message->cmd |= serial::cmdSetEom;
    message->eomLen = static_cast<std::int32_t>(eom.size());
    std::copy(eom.begin(), eom.end(), message->eomString.begin());
  }
  setTimeout(request.timeout + kQueueTime);
  return sendReply(std::move(message));
}

long TextDevice::completeIO(dbCommon* record, Message&& message) {
  const auto reply = Char8ArrayMessage::tryFrom(std::move(message));
  if (!reply) return fail(record, "the reply is not a Char8Array message");
  const auto status = (*reply)->status;
  const auto bytes = reply->value();
  const std::string text(bytes.begin(), bytes.end());
  return takeAnswer(record, {text, status});
}

const char* reasonOf(std::int32_t status) noexcept {
  switch (status) {
    case serial::serialServerStatusTimeout:
      return "timeout of the serial line";
    case serial::serialServerStatusOverflow:
      return "overflow of the serial line";
    default:
      return "error of the serial line";
  }
}

long takeWriteStatus(DevMpf& device, dbCommon* record, std::int32_t status) {
  return status == serial::serialServerStatusOK ? MPF_OK : device.fail(record, reasonOf(status));
}

void setUndefined(dbCommon* record, const char* reason) {
  record->udf = TRUE;
  recGblSetSevrMsg(record, UDF_ALARM, INVALID_ALARM, "%s", reason);
}

}  // namespace mpf
