// SPDX-License-Identifier: MIT
// DevMpf: base class of EPICS device support for records that talk to an MPF server (manual, "MPF
// Device support"). One object serves one record.
//
//   class DevAoLamp : public mpf::DevMpf {
//    public:
//     explicit DevAoLamp(aoRecord* record)
//         : DevMpf(reinterpret_cast<dbCommon*>(record), &record->out) {}
//     long startIO(dbCommon* record) override {
//       const auto value = reinterpret_cast<aoRecord*>(record)->rval;
//       return sendReply(mpf::Int32Message({.address = getSignal(), .value = value}));
//     }
//     long completeIO(dbCommon* record, mpf::Message&& message) override {
//       const auto* reply = message.tryAs<mpf::Int32>();
//       return reply != nullptr && reply->status == 0 ? MPF_OK : fail(record, "no success");
//     }
//     static long init(dbCommon* record) {
//       return mpf::bindDevice<DevAoLamp>(reinterpret_cast<aoRecord*>(record));
//     }
//   };
//   MAKE_LINCONV_DSET(devAoLamp, DevAoLamp::init)
//
//   device(ao, VME_IO, devAoLamp, "Lamp")                                      in lamp.dbd
//   field(OUT, "#C0 S3 @lamp,parameters")                                      in a database
//
//   record processes ─► startIO() ─ sendReply() ─► PACT ── reply ──► completeIO() ─► record complete
//          │                                         └─ no reply ──► alarm ────────► record complete
//          └─ no connection ─► alarm COMM, INVALID
//   further replies ─► the record processes again: completeIO()
//   connected ─► connectIO() ─► a record that has processed before processes again
//   disconnected ─► connectIO() ─► alarm COMM, INVALID, without processing
//   with `ioInterrupt`, the process of the server is stopped, or runs again ─► a record that has
//     processed before processes again: alarm COMM, INVALID, or startIO()
//
// All records of an IOC share one dispatcher, and records that name the same server share one
// connection; a record with `ioInterrupt` has its own, because a server may keep one subscription
// for each client. A message waits for its record in a queue; one callback for each PRIO processes
// the messages of all records. When 64 messages of a record wait, further messages that are not the
// first reply to a request replace the oldest ones, and are counted as overruns (dbior).
//
// Threads  EPICS calls the virtual functions with the record locked (dbScanLock), on a thread that
//          processes records or on a callback thread. Call send() only in them.
// Errors   a record whose request has no reply gets an alarm with severity INVALID: TIMEOUT (no
//          reply in time), COMM (no connection, connection lost, server stopped), READ or WRITE
//          (the server refused the request, a queue is full, not a message of the expected type).
//          AMSG has the reason. A std::exception of startIO() or completeIO() is a READ or WRITE
//          alarm with its text. One of another virtual function is logged; convert() then refuses
//          the change.
// Owner    the object belongs to the record; it lives until the IOC ends.
// Source   manual, "MPF Device support", "EXAMPLE Implementation: ip330Scan".
#pragma once

#include <chrono>
#include <dbCommon.h>
#include <dbScan.h>
#include <devSup.h>
#include <epicsExport.h>
#include <link.h>
#include <memory>
#include <string>

#include <mpf/message_of.h>

// Results of startIO() and completeIO(), for record support.
// NOLINTBEGIN(readability-identifier-naming): the names of the original MPF
inline constexpr long MPF_OK = 0;
inline constexpr long MPF_NoConvert = 2;  // success; an ai record does not convert RVAL to VAL
// NOLINTEND(readability-identifier-naming)

namespace mpf {

// What happens with the reply to a message.
enum ReplyType { replyTypeNone, replyTypeCompleteIO, replyTypeReceiveReply };

class DevMpf {
 public:
  //   record      initialised by record support; outlives this object
  //   link        its INP or OUT field, of type VME_IO or INST_IO:
  //                 #C<location> S<signal> @<server>[,| ]<parameters>
  //                 @<server>[:<location>] <parameters>
  //   ioInterrupt the record may have SCAN "I/O Intr": ioScan() is initialised
  // An invalid link makes getStatus() nonzero and disables the record.
  DevMpf(dbCommon* record, DBLINK* link, bool ioInterrupt = false);
  virtual ~DevMpf();
  DevMpf(const DevMpf&) = delete;
  DevMpf& operator=(const DevMpf&) = delete;

  // Starts to connect to the server, without waiting. Call it after the constructor of the derived
  // class, once: bindDevice() does.
  void bind();

  // Called when the record processes and its server is connected. After a sendReply() the record
  // stays active (PACT) until the reply.
  //   returns  0, or another value when nothing was sent; then the function has set an alarm
  virtual long startIO(dbCommon* record) = 0;
  // Called with a reply to a message that was sent with replyTypeCompleteIO, as part of the
  // processing of the record. The server may send further replies; then the record processes once
  // for each.
  //   returns  MPF_OK, MPF_NoConvert, or another value for a failure
  virtual long completeIO(dbCommon* record, Message&& message) = 0;
  // Called with a reply to a message that was sent with replyTypeReceiveReply, or with the
  // RequestFateMessage that says why no reply will arrive. The record does not process. The default
  // logs the message.
  virtual void receiveReply(dbCommon* record, Message&& message);
  // Called when the connection is made or has ended. An implementation of a derived class ends with
  // a call of this one.
  virtual void connectIO(dbCommon* record, const Connect& connect);
  // Called with an OutOfBand message. The default logs it. If it is the first reply to a request of
  // sendReply(), the record completes before, with a READ or WRITE alarm; a reply that follows
  // completes it again.
  virtual void outOfBandIO(dbCommon* record, Message&& message);
  // Called by ai and ao records when fields of the linear conversion change (special_linconv).
  //   pass     0 before the change, 1 after it
  //   returns  0, or a status of EPICS that refuses the change
  virtual long convert(dbCommon* record, int pass);

  // Sends a message to the server.
  //   returns  0 when it was sent; otherwise -1, and the record has an alarm with the reason
  //   replyTypeCompleteIO: at most one request is outstanding
  long send(Message&& message, ReplyType reply = replyTypeNone);
  long sendReply(Message&& message) { return send(std::move(message), replyTypeCompleteIO); }

  [[nodiscard]] bool isConnected() const noexcept;
  // Waits until the server is connected; false after `timeout`. Never call it while the IOC starts.
  [[nodiscard]] bool connectWait(std::chrono::nanoseconds timeout) const;

  // The part of the link after the server's name, and the signal (0 in an INST_IO link).
  [[nodiscard]] const char* getUserParm() const noexcept;
  [[nodiscard]] int getSignal() const noexcept;
  // The name of the server.
  [[nodiscard]] const std::string& getServer() const noexcept;
  // The result for init_record(): 0 or an error.
  [[nodiscard]] long getStatus() const noexcept;
  void setStatus(long status) noexcept;
  // How long a request waits for its reply; 5 s unless set, 0: without limit.
  void setTimeout(std::chrono::nanoseconds timeout) noexcept;

  // Sets a READ or WRITE alarm, INVALID, with AMSG `reason` (39 characters are kept).
  //   returns  -1
  long fail(dbCommon* record, const char* reason);

  // The scan list of records with SCAN "I/O Intr", for scanIoRequest(); null without ioInterrupt.
  [[nodiscard]] IOSCANPVT ioScan() const noexcept;

  // Entries of device support tables.
  static long readWrite(dbCommon* record);
  static long getIoIntInfo(int detach, dbCommon* record, IOSCANPVT* scan);
  static long linearConvert(dbCommon* record, int pass);

 private:
  friend class RecordQueue;
  class Impl;  // NOLINT(cppcoreguidelines-virtual-class-destructor): deleted as Impl only
  std::unique_ptr<Impl> impl_;
};

// Makes the device support of a record and binds it, for init_record(). The object lives until the
// IOC ends.
//   returns  getStatus()
template <class Device, class Record>
long bindDevice(Record* record) {
  auto* device = new Device(record);
  device->bind();
  return device->getStatus();
}

// A device support table; its sixth entry is special_linconv of ai and ao records.
struct MpfDset {
  dset common;
  long (*readWrite)(dbCommon*);
  long (*linearConvert)(dbCommon*, int);
};

}  // namespace mpf

// Define and export a device support table `name`. `init` is a long (*)(dbCommon*).
// NOLINTNEXTLINE(readability-identifier-naming): only for the macros below
#define MPF_DSET_(name, init, number, convert)                                   \
  namespace {                                                                    \
  mpf::MpfDset name{{number, nullptr, nullptr, init, mpf::DevMpf::getIoIntInfo}, \
                    mpf::DevMpf::readWrite,                                      \
                    convert};                                                    \
  }                                                                              \
  extern "C" {                                                                   \
  epicsExportAddress(dset, name);                                                \
  }
// NOLINTBEGIN(cppcoreguidelines-macro-usage,readability-identifier-naming): of the original MPF
#define MAKE_LINCONV_DSET(name, init) MPF_DSET_(name, init, 6, mpf::DevMpf::linearConvert)
#define MAKE_DSET(name, init) MPF_DSET_(name, init, 5, nullptr)
// NOLINTEND(cppcoreguidelines-macro-usage,readability-identifier-naming)
