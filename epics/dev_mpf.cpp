// SPDX-License-Identifier: MIT
#include <mpf/epics/dev_mpf.h>

#include <alarm.h>
#include <atomic>
#include <cstring>
#include <dbAccess.h>
#include <dbEvent.h>
#include <dbLock.h>
#include <dbStaticLib.h>
#include <epicsStdio.h>
#include <epicsThread.h>
#include <epicsTime.h>
#include <errlog.h>
#include <fmt/format.h>
#include <optional>
#include <recGbl.h>
#include <recSup.h>
#include <utility>

#include "epics/common_fields.h"
#include "epics/every_output.h"
#include "epics/fate_text.h"
#include "epics/ioc_clients.h"
#include "epics/link_address.h"
#include "epics/record_queue.h"
#include "epics/shared_client.h"

namespace mpf {
namespace {

constexpr Nanoseconds kDefaultTimeout = std::chrono::seconds(5);
constexpr double kConnectPollSeconds = 0.01;

// The VAL field of any record.
void* valueOf(dbCommon* record) noexcept {
  return reinterpret_cast<char*>(record) + record->rdes->pvalFldDes->offset;
}

bool isOutputLink(const dbCommon* record, const DBLINK* link) noexcept {
  const auto* description = record->rdes;
  for (short at = 0; at < description->no_links; ++at) {
    const auto* field = description->papFldDes[description->link_ind[at]];
    if (reinterpret_cast<const char*>(record) + field->offset ==
        reinterpret_cast<const char*>(link))
      return field->field_type == DBF_OUTLINK;
  }
  return false;
}

// Why the server is not connected, in the 39 characters of AMSG: the link has the server's name.
std::string whyDisconnected(const SharedClient& connection) {
  auto reason = connection.notConnectedBecause();
  const auto name = fmt::format("server \"{}\" ", connection.server());
  for (const auto& prefix : {fmt::format("{}at location {} ", name, connection.location()), name})
    if (reason.starts_with(prefix)) return "server " + reason.substr(prefix.size());
  return reason;
}

// The time stamp of a message; now, if the server sent none or one that EPICS cannot represent.
epicsTimeStamp timeStampOf(std::int64_t timeNs) noexcept {
  constexpr std::int64_t kSecond = 1'000'000'000;
  epicsTimeStamp stamp{};
  const auto seconds = timeNs / kSecond - POSIX_TIME_AT_EPICS_EPOCH;
  if (timeNs <= 0 || seconds < 0 || seconds > UINT32_MAX) {
    epicsTimeGetCurrent(&stamp);
  } else {
    stamp.secPastEpoch = static_cast<epicsUInt32>(seconds);
    stamp.nsec = static_cast<epicsUInt32>(timeNs % kSecond);
  }
  return stamp;
}

class ScanLock {
 public:
  explicit ScanLock(dbCommon* record) : record_(record) { dbScanLock(record); }
  ~ScanLock() { dbScanUnlock(record_); }
  ScanLock(const ScanLock&) = delete;
  ScanLock& operator=(const ScanLock&) = delete;

 private:
  dbCommon* record_;
};

}  // namespace

class DevMpf::Impl final : public SharedClient::Member,
                           public IocClients::Device,
                           public CallbackQueue::Record {
 public:
  Impl(DevMpf& device, dbCommon* record, DBLINK* link, bool ioInterrupt)
      : device_(device), record_(record), isOutput_(isOutputLink(record, link)) {
    if (ioInterrupt) scanIoInit(&scan_);
    try {
      address_ = LinkAddress::of(*link);
      // A server may keep one subscription for each client.
      connection_ = IocClients::instance().connectionTo(address_.server, address_.location,
                                                        ioInterrupt ? record->name : "");
      member_ = connection_->add(*this);
    } catch (const std::exception& error) {
      refuseLink(record, isOutput_ ? "OUT" : "INP", error.what());
      status_ = S_db_badField;
    }
  }

  // --- any thread
  void deliver(Message&& message) noexcept override {
    if (queue_.push(std::move(message))) callbacks_.add(*this);
  }
  void tick(std::int64_t nowNs) override {
    // PAIR(request-id): if it is that of a new request, the deadline of the one before is gone.
    const auto requestId = requestId_.load(std::memory_order_acquire);
    const auto deadlineNs = deadlineNs_.load(std::memory_order_relaxed);
    if (deadlineNs != 0 && nowNs >= deadlineNs) connection_->cancel(requestId);
  }
  void print() const override {
    if (const auto overruns = queue_.overruns(); overruns != 0)
      epicsStdoutPrintf("  %s: %llu overruns\n", record_->name,
                        static_cast<unsigned long long>(overruns));
  }

  // --- the callback's thread
  bool processOne() override {
    const ScanLock lock(record_);
    Message message;
    if (queue_.tryTake(message, isRequestOutstanding_)) handle(std::move(message));
    return queue_.finish(isRequestOutstanding_);
  }

  // --- with the record locked
  // Record support, which calls it, is C: no exception may leave.
  long process() noexcept {
    hasProcessed_ = true;
    try {
      return reply_ ? completeIO() : startIO();
    } catch (const std::exception& error) {
      isDelayOver_ = false;
      return device_.fail(record_, error.what());
    }
  }
  long send(Message&& message, ReplyType reply) {
    if (reply == replyTypeCompleteIO && isDelayOver_)
      return device_.fail(record_, "SIMM was changed during SDLY");
    const auto deadline = timeout_.count() == 0 ? Deadline::never() : Deadline::after(timeout_);
    auto& requestId = reply == replyTypeCompleteIO ? requestId_ : otherRequestId_;
    requestId.store(0, std::memory_order_relaxed);
    const auto result =
        connection_ ? connection_->send(member_, reply, std::move(message), deadline, requestId)
                    : SendResult::notConnected;
    if (result == SendResult::notConnected) return failDisconnected();
    if (result != SendResult::sent) return device_.fail(record_, toString(result));
    if (reply == replyTypeCompleteIO) {
      isRequestOutstanding_ = true;
      deadlineNs_.store(deadline.isNever() ? 0 : deadline.ns(), std::memory_order_relaxed);
      record_->pact = TRUE;
    }
    return 0;
  }
  void onConnect(const Connect& connect) {
    if (record_->pact) return;  // its request ends with an alarm of its own
    if (connect.status == ConnectStatus::connectYes) {
      const EveryOutput every(record_, EveryOutput::Pass::write);
      if (hasProcessed_ || processesAtStart(record_)) dbProcess(record_);
      return;
    }
    failDisconnected();
    stampNow();
    recGblGetTimeStamp(record_);
    const auto mask = recGblResetAlarms(record_);
    if (mask != 0) db_post_events(record_, valueOf(record_), mask | DBE_VALUE | DBE_LOG);
  }

  // NOLINTBEGIN(readability-identifier-naming): DevMpf uses them as its own
  DevMpf& device_;
  dbCommon* const record_;
  const bool isOutput_;
  LinkAddress address_;
  std::shared_ptr<SharedClient> connection_;
  long status_ = 0;
  IOSCANPVT scan_ = nullptr;
  Nanoseconds timeout_ = kDefaultTimeout;
  // NOLINTEND(readability-identifier-naming)

 private:
  long completeIO() {
    auto reply = std::move(*reply_);
    reply_.reset();
    if (const auto* fate = reply.tryAs<RequestFate>()) return failFate(fate->fate);
    if (reply.getType() == MessageType::outOfBand)
      return device_.fail(record_, "the reply is an OutOfBand message");
    return device_.completeIO(record_, std::move(reply));
  }
  long startIO() {
    isDelayOver_ = record_->pact;
    const auto status = startIfConnected();
    isDelayOver_ = false;
    if (record_->nsev == INVALID_ALARM && !hasMessageTime_) stampNow();
    return status;
  }
  long startIfConnected() {
    if (!connection_ || !connection_->isConnected()) return failDisconnected();
    if (connection_->isServerStopped()) return failComm("server is stopped");
    return device_.startIO(record_);
  }
  void handle(Message&& message) try {
    if (const auto* connect = message.tryAs<Connect>()) return device_.connectIO(record_, *connect);
    if (!message) return onServerStopped();
    stamp(timeStampOf(message.getTimeStampNs()));
    hasMessageTime_ = true;
    dispatch(std::move(message));
    hasMessageTime_ = false;
  } catch (const std::exception& error) {
    hasMessageTime_ = false;
    errlogPrintf("%s: %s\n", record_->name, error.what());
  }
  // The server was stopped, or runs again: startIfConnected() sets the alarm, or gets the value.
  void onServerStopped() {
    if (hasProcessed_ && !record_->pact) dbProcess(record_);
  }
  void stamp(const epicsTimeStamp& time) {
    if (record_->tse == epicsTimeEventDeviceTime) record_->time = time;
  }
  void stampNow() { stamp(timeStampOf(0)); }
  void dispatch(Message&& message) {
    if (message.getType() == MessageType::outOfBand) return notify(std::move(message));
    switch (SharedClient::replyTypeOf(message)) {
      case replyTypeCompleteIO:
        return complete(std::move(message));
      case replyTypeReceiveReply:
        return device_.receiveReply(record_, std::move(message));
      case replyTypeNone:
        return;
    }
  }
  // If the notice has ended the request, the server need not send any other reply.
  void notify(Message&& notice) {
    if (endsRequest(notice) && SharedClient::replyTypeOf(notice) == replyTypeCompleteIO)
      complete(notice.duplicate());
    device_.outOfBandIO(record_, std::move(notice));
  }
  void complete(Message&& message) {
    const bool isFirst = endsRequest(message);
    if (isFirst) {
      isRequestOutstanding_ = false;
      deadlineNs_.store(0, std::memory_order_relaxed);
    }
    reply_ = std::move(message);
    const EveryOutput every(record_, EveryOutput::Pass::completion);
    if (!record_->pact) dbProcess(record_);
    else if (isFirst) record_->rset->process(record_);
    reply_.reset();  // a disabled record does not use it
  }
  long failDisconnected() {
    return failComm(connection_ ? whyDisconnected(*connection_).c_str() : "invalid link");
  }
  long failComm(const char* reason) {
    recGblSetSevrMsg(record_, COMM_ALARM, INVALID_ALARM, "%s", reason);
    return -1;
  }
  long failFate(Fate fate) {
    switch (fate) {
      case Fate::refused:
        return device_.fail(record_, textOf(fate));
      case Fate::neverTaken:
      case Fate::outcomeUnknown:
        return failComm(textOf(fate));
      case Fate::expired:
      case Fate::cancelled:
        break;
    }
    recGblSetSevrMsg(record_, TIMEOUT_ALARM, INVALID_ALARM, "no reply in %g s",
                     std::chrono::duration<double>(timeout_).count());
    return -1;
  }

  friend class DevMpf;
  std::uint32_t member_ = 0;
  bool isRequestOutstanding_ = false;  // these five with the record locked
  bool hasProcessed_ = false;
  // The record was simulated when it became active: Base completes it now, and waits for no reply.
  bool isDelayOver_ = false;
  bool hasMessageTime_ = false;  // TSE -2: the record processes with the time of a message
  std::optional<Message> reply_;  // the message that the record processes now
  RecordQueue queue_;
  CallbackQueue& callbacks_ = IocClients::instance().callbacks(record_->prio);
  std::atomic<std::uint32_t> requestId_{0};  // of the request that completes the I/O
  std::atomic<std::uint32_t> otherRequestId_{0};
  std::atomic<std::int64_t> deadlineNs_{0};  // of the outstanding request; 0: none
};

DevMpf::DevMpf(dbCommon* record, DBLINK* link, bool ioInterrupt)
    : impl_(std::make_unique<Impl>(*this, record, link, ioInterrupt)) {
  record->dpvt = this;
}

DevMpf::~DevMpf() { impl_->record_->dpvt = nullptr; }

void DevMpf::bind() {
  IocClients::instance().add(std::unique_ptr<DevMpf>(this), *impl_);
  if (impl_->connection_) impl_->connection_->bind();
}

void DevMpf::receiveReply(dbCommon* record, Message&& message) {
  errlogPrintf("%s: unexpected %s message\n", record->name,
               std::string(toString(message.getType())).c_str());
}

void DevMpf::connectIO(dbCommon*, const Connect& connect) { impl_->onConnect(connect); }

void DevMpf::outOfBandIO(dbCommon* record, Message&&) {
  errlogPrintf("%s: unexpected outOfBand message\n", record->name);
}

long DevMpf::convert(dbCommon*, int) { return 0; }

long DevMpf::send(Message&& message, ReplyType reply) {
  return impl_->send(std::move(message), reply);
}

bool DevMpf::isConnected() const noexcept {
  return impl_->connection_ && impl_->connection_->isConnected();
}
bool DevMpf::connectWait(std::chrono::nanoseconds timeout) const {
  const auto deadline = Deadline::after(timeout);
  while (!isConnected()) {
    if (deadline.hasPassed()) return false;
    epicsThreadSleep(kConnectPollSeconds);
  }
  return true;
}
const char* DevMpf::getUserParm() const noexcept { return impl_->address_.parameters.c_str(); }
int DevMpf::getSignal() const noexcept { return impl_->address_.signal; }
const std::string& DevMpf::getServer() const noexcept { return impl_->address_.server; }
long DevMpf::getStatus() const noexcept { return impl_->status_; }
void DevMpf::setStatus(long status) noexcept { impl_->status_ = status; }
void DevMpf::setTimeout(std::chrono::nanoseconds timeout) noexcept { impl_->timeout_ = timeout; }
IOSCANPVT DevMpf::ioScan() const noexcept { return impl_->scan_; }

long DevMpf::fail(dbCommon* record, const char* reason) {
  recGblSetSevrMsg(record, impl_->isOutput_ ? WRITE_ALARM : READ_ALARM, INVALID_ALARM, "%s",
                   reason);
  return -1;
}

long DevMpf::readWrite(dbCommon* record) {
  auto* const device = static_cast<DevMpf*>(record->dpvt);
  if (device == nullptr) {
    recGblSetSevrMsg(record, SOFT_ALARM, INVALID_ALARM, "no device support");
    return S_dev_noDevSup;
  }
  forgetReason(record);
  return device->impl_->process();
}

long DevMpf::getIoIntInfo(int, dbCommon* record, IOSCANPVT* scan) {
  const auto* device = static_cast<const DevMpf*>(record->dpvt);
  if (device == nullptr || device->ioScan() == nullptr) return S_dev_noDevSup;
  *scan = device->ioScan();
  return 0;
}

long DevMpf::linearConvert(dbCommon* record, int pass) {
  auto* device = static_cast<DevMpf*>(record->dpvt);
  if (device == nullptr) return S_dev_noDevSup;
  try {
    return device->convert(record, pass);
  } catch (const std::exception& error) {
    errlogPrintf("%s: %s\n", record->name, error.what());
    return S_db_badField;
  }
}

}  // namespace mpf
