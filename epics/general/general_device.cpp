// SPDX-License-Identifier: MIT
#include "epics/general/general_device.h"

#include <alarm.h>
#include <dbAccess.h>
#include <dbEvent.h>
#include <dbScan.h>
#include <dbStaticLib.h>
#include <fmt/format.h>
#include <menuOmsl.h>
#include <recGbl.h>
#include <recSup.h>
#include <stdexcept>
#include <utility>

#include "epics/common_fields.h"
#include "epics/every_output.h"
#include "epics/fate_text.h"
#include "epics/link_address.h"

namespace mpf {
namespace {

using Mode = LinkOptions::Mode;

LinkOptions optionsOf(const dbCommon* record, const DBLINK& link, const RecordAccess& access) {
  const auto type = access.type(record);
  if (type == MessageType::none) throw std::invalid_argument("FTVL=STRING: use CHAR or a number");
  const auto inputMode = record->scan == SCAN_IO_EVENT ? Mode::subscribe : Mode::read;
  const auto options = LinkOptions::parse(LinkAddress::of(link).parameters,
                                          {.type = type,
                                           .mode = access.isOutput() ? Mode::write : inputMode,
                                           .canHaveBits = access.canHaveBits,
                                           .canHaveRange = access.canHaveRange});
  if (!makeQuery(options, options.cmd))
    throw std::invalid_argument(
        fmt::format("value={} does not fit type={}", options.value, toString(options.type)));
  return options;
}

// Whether the server has not received the request in time; it may be busy or stopped.
bool isExpired(const Message& message) {
  const auto* fate = message.tryAs<RequestFate>();
  return fate != nullptr && fate->fate == Fate::expired;
}

// Makes an alarm visible that was set while the record did not process.
void postAlarm(dbCommon* record) {
  recGblGetTimeStamp(record);
  const auto mask = recGblResetAlarms(record);
  auto* value = reinterpret_cast<char*>(record) + record->rdes->pvalFldDes->offset;
  if (mask != 0) db_post_events(record, value, mask);
}

}  // namespace

GeneralDevice::GeneralDevice(dbCommon* record, DBLINK* link, const RecordAccess& access,
                             const LinkOptions& options)
    : DevMpf(record, link, options.mode == Mode::subscribe), access_(access), options_(options) {
  if (options.timeout)
    setTimeout(std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(*options.timeout)));
  access.prepare(record, options);
}

long GeneralDevice::init(dbCommon* record, DBLINK* link, const RecordAccess& access) {
  try {
    auto* device = new GeneralDevice(record, link, access, optionsOf(record, *link, access));
    device->bind();
    return device->getStatus();
  } catch (const std::exception& error) {
    refuseLink(record, access.isOutput() ? "OUT" : "INP", error.what());
    return S_db_badField;
  }
}

long GeneralDevice::convert(dbCommon* record, int /*pass*/) {
  access_.prepare(record, options_);
  return 0;
}

long GeneralDevice::startIO(dbCommon* record) {
  switch (options_.mode) {
    case Mode::write:
      return stored_ ? endReadback(record) : write(record);
    case Mode::read:
      return sendReply(makeQuery(options_, options_.cmd).value());
    case Mode::subscribe:
      break;
  }
  if (pending_) return take(record, *std::exchange(pending_, std::nullopt));
  if (subscription_ == Subscription::none) subscribe();
  return subscription_ == Subscription::none ? -1 : keepValue(record);
}

long GeneralDevice::write(dbCommon* record) {
  const auto value = access_.load(record, options_, scratch_);
  auto request = value ? makeMessage(options_, options_.cmd, *value) : std::nullopt;
  if (!request) return fail(record, "the value does not fit the message");
  hasWritten_ = true;
  return sendReply(std::move(*request));
}

long GeneralDevice::query(std::int32_t cmd) {
  return send(makeQuery(options_, cmd).value(), replyTypeReceiveReply);
}

void GeneralDevice::subscribe() {
  const bool isSent = query(options_.cmd) == 0;
  subscription_ = isSent ? Subscription::requested : Subscription::none;
}

long GeneralDevice::completeIO(dbCommon* record, Message&& message) {
  if (options_.mode == Mode::read) return take(record, message);
  const auto reading = readingOf(message);
  if (!reading) return fail(record, "the reply has no status");
  return reading->status == 0 ? MPF_OK : failStatus(record, reading->status);
}

void GeneralDevice::receiveReply(dbCommon* record, Message&& message) {
  if (options_.mode == Mode::write) return takeReadback(record, message);
  if (isExpired(message)) return subscribe();
  pending_ = std::move(message);
  if (!record->pact) dbProcess(record);  // a disabled or simulated record uses it later
}

void GeneralDevice::takeReadback(dbCommon* record, const Message& message) {
  if (hasWritten_ || record->pact) return;  // the record has a newer value
  hasReadBack_ = message.getType() != MessageType::requestFate;
  static_cast<void>(take(record, message));
  if (stored_) showReadback(record);
  else postAlarm(record);
  if (isExpired(message)) static_cast<void>(query(*options_.readback));
}

long GeneralDevice::endReadback(dbCommon* record) {
  const auto status = repeatResult(record);
  stored_.reset();
  return status;
}

void GeneralDevice::showReadback(dbCommon* record) {
  auto& outputMode = *access_.outputMode(record);
  // With closed_loop, record support would replace the value by that of DOL.
  const auto before = std::exchange(outputMode, menuOmslsupervisory);
  dbProcess(record);
  outputMode = before;
  // A disabled or simulated record has not posted the value.
  if (std::exchange(stored_, std::nullopt)) db_post_events(record, nullptr, DBE_VALUE | DBE_LOG);
}

long GeneralDevice::take(dbCommon* record, const Message& message) {
  stored_.reset();
  if (const auto* fate = message.tryAs<RequestFate>()) {
    subscription_ = Subscription::none;
    return fail(record, textOf(fate->fate));
  }
  const auto reading = readingOf(message);
  if (!reading)
    return fail(record, fmt::format("{} has no value", toString(message.getType())).c_str());
  if (reading->status != 0) return failStatus(record, reading->status);
  const auto stored = access_.store(record, reading->value, options_);
  if (stored == Stored::doesNotFit) return fail(record, "the value does not fit the record");
  stored_ = stored;
  return repeatResult(record);
}

long GeneralDevice::repeatResult(dbCommon* record) {
  if (!stored_) return fail(record, "no value from the server yet");
  if (*stored_ == Stored::truncated)
    recGblSetSevrMsg(record, READ_ALARM, MINOR_ALARM, "the value is longer than the record");
  return *stored_ == Stored::converted && !access_.isOutput() ? MPF_NoConvert : MPF_OK;
}

long GeneralDevice::keepValue(dbCommon* record) {
  const auto status = repeatResult(record);
  return status == MPF_OK && access_.isSmoothed(record) ? MPF_NoConvert : status;
}

long GeneralDevice::failStatus(dbCommon* record, std::int32_t status) {
  return fail(record, fmt::format("status {} from the server", status).c_str());
}

void GeneralDevice::connectIO(dbCommon* record, const Connect& connect) {
  const bool isConnected = connect.status == ConnectStatus::connectYes;
  if (!isConnected) {
    subscription_ = Subscription::none;
    pending_.reset();
  }
  if (isConnected && options_.mode == Mode::write) return connectOutput(record);
  if (isConnected && options_.mode == Mode::subscribe) return subscribe();
  DevMpf::connectIO(record, connect);
}

// A value is written at the first connection only when PINI asked for it, and the record has not
// written it already.
void GeneralDevice::connectOutput(dbCommon* record) {
  const bool isFirst = !std::exchange(hasConnected_, true);
  if (options_.readback && !hasReadBack_ && !hasWritten_) {
    static_cast<void>(query(*options_.readback));
  } else if (hasWritten_ ? options_.rewrite : isFirst && processesAtStart(record)) {
    const EveryOutput every(record, EveryOutput::Pass::write);
    if (!record->pact) dbProcess(record);
  }
}

}  // namespace mpf
