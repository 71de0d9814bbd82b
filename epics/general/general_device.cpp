// SPDX-License-Identifier: MIT
#include "epics/general/general_device.h"

#include <alarm.h>
#include <dbAccess.h>
#include <dbEvent.h>
#include <dbScan.h>
#include <dbStaticLib.h>
#include <errlog.h>
#include <fmt/format.h>
#include <menuPini.h>
#include <recGbl.h>
#include <recSup.h>
#include <stdexcept>
#include <utility>

#include "epics/fate_text.h"
#include "epics/link_address.h"

namespace mpf {
namespace {

using Mode = LinkOptions::Mode;

LinkOptions optionsOf(const dbCommon* record, const DBLINK& link, const RecordAccess& access) {
  const auto type = access.type(record);
  if (type == MessageType::none) throw std::invalid_argument("FTVL=STRING: use CHAR or a number");
  const auto inputMode = record->scan == SCAN_IO_EVENT ? Mode::subscribe : Mode::read;
  return LinkOptions::parse(LinkAddress::of(link).parameters,
                            {.type = type, .mode = access.isOutput() ? Mode::write : inputMode});
}

// Makes an alarm visible that was set while the record did not process.
void postAlarm(dbCommon* record) {
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
    errlogPrintf("%s: %s: %s\n", record->name, access.isOutput() ? "OUT" : "INP", error.what());
    record->pact = TRUE;  // the record never processes
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
      return stored_ ? repeatResult(record) : write(record);
    case Mode::read: {
      auto request = makeQuery(options_, options_.cmd);
      return request ? sendReply(std::move(*request))
                     : fail(record, "value= does not fit the type");
    }
    case Mode::subscribe:
      break;
  }
  if (pending_) return take(record, *std::exchange(pending_, std::nullopt));
  if (subscription_ == Subscription::none) subscribe(record);
  return subscription_ == Subscription::none ? -1 : repeatResult(record);
}

long GeneralDevice::write(dbCommon* record) {
  auto request = makeMessage(options_, options_.cmd, access_.load(record, options_, scratch_));
  if (!request) return fail(record, "the value does not fit the message");
  hasWritten_ = true;
  return sendReply(std::move(*request));
}

long GeneralDevice::query(dbCommon* record, std::int32_t cmd) {
  auto request = makeQuery(options_, cmd);
  return request ? send(std::move(*request), replyTypeReceiveReply)
                 : fail(record, "value= does not fit the type");
}

void GeneralDevice::subscribe(dbCommon* record) {
  const bool isSent = query(record, options_.cmd) == 0;
  subscription_ = isSent ? Subscription::requested : Subscription::none;
}

long GeneralDevice::completeIO(dbCommon* record, Message&& message) {
  if (options_.mode == Mode::read) return take(record, message);
  const auto reading = readingOf(message);
  if (!reading) return fail(record, "the reply has no status");
  return reading->status == 0 ? MPF_OK : failStatus(record, reading->status);
}

void GeneralDevice::receiveReply(dbCommon* record, Message&& message) {
  const auto* fate = message.tryAs<RequestFate>();
  const bool isExpired = fate != nullptr && fate->fate == Fate::expired;
  if (options_.mode == Mode::write) {
    if (hasWritten_ || record->pact) return;  // the record has a newer value
    hasReadBack_ = fate == nullptr;
    static_cast<void>(take(record, message));
    if (!stored_) postAlarm(record);
    else dbProcess(record);  // posts the value; write() does not run
    stored_.reset();
    // The server has not received the request in time; it may be busy or stopped.
    if (isExpired) static_cast<void>(query(record, *options_.readback));
    return;
  }
  if (isExpired) return subscribe(record);
  pending_ = std::move(message);
  if (!record->pact) dbProcess(record);  // a disabled or simulated record uses it later
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
  if (isConnected && options_.mode == Mode::subscribe) return subscribe(record);
  DevMpf::connectIO(record, connect);
}

// A value is written at the first connection only when PINI asked for it.
void GeneralDevice::connectOutput(dbCommon* record) {
  const bool isFirst = !std::exchange(hasConnected_, true);
  if (options_.readback && !hasReadBack_ && !hasWritten_) {
    static_cast<void>(query(record, *options_.readback));
  } else if ((isFirst && record->pini == menuPiniYES) || (options_.rewrite && hasWritten_)) {
    if (!record->pact) dbProcess(record);
  }
}

}  // namespace mpf
