// SPDX-License-Identifier: MIT
// DevMpf in the form of the original MPF: base class of device support that owns its messages by
// pointer (manual, "MPF Device support"). One object serves one record.
//
//   class DevAiLamp : public DevMpf {
//   public:
//     DevAiLamp(dbCommon* record, DBLINK* link) : DevMpf(record, link, false) {}
//     long startIO(dbCommon*) { return sendReply(new Int32Message); }
//     long completeIO(dbCommon* record, Message* message) { ...; delete message; return MPF_OK; }
//     static long dev_init(void* record);    // new DevAiLamp(...)->getStatus()
//   };
//   MAKE_LINCONV_DSET(devAiLamp, DevAiLamp::dev_init)
//
// It is the class of <mpf/epics/dev_mpf.h> with another form of messages: connections, alarms and
// further replies are as described there. A record whose request ends without a reply gets an
// alarm; completeIO() is not called. receiveReply() gets a message with one of fateStatus instead
// of the reply; its type is that of the last request with this clientExtra, or Int32Message for a
// SerialConfigMessage.
//
// Threads  as mpf::DevMpf: the record is locked in all calls.
// Crash    as mpf::DevMpf.
// Trust    as <mpf/classic/message.h>.
// Source   manual, "MPF Device support", "EXAMPLE Implementation: ip330Scan".
#pragma once

#include <map>

#include <mpf/classic/message.h>
#include <mpf/epics/dev_mpf.h>

// NOLINTBEGIN(readability-identifier-naming): names of the manual

typedef mpf::ReplyType replyType;
using mpf::replyTypeCompleteIO;
using mpf::replyTypeNone;
using mpf::replyTypeReceiveReply;

class DevMpf : public mpf::DevMpf {
 public:
  //   iointValid  the record may have SCAN "I/O Intr": ioscanpvt is initialised
  DevMpf(dbCommon* record, DBLINK* link, bool iointValid);
  // Starts to connect. Sources of releases before 1-9 do not call it: it is called for every object
  // when all records are initialised.
  void bind();

  // Owns the message. As completeIO() of mpf::DevMpf.
  virtual long completeIO(dbCommon* record, Message* message) = 0;
  // Owns the message. The default logs and deletes it.
  virtual void receiveReply(dbCommon* record, Message* message);
  // Owns the ConnectMessage. An implementation of a derived class ends with a call of this one,
  // which deletes it.
  virtual void connectIO(dbCommon* record, Message* message);
  // Owns the message. The default logs and deletes it.
  virtual void outOfBandIO(dbCommon* record, OutOfBandMessage* message);

  // Own the message, whatever the result.
  //   returns  0 when it was sent; otherwise -1, and the record has an alarm with the reason
  int send(Message* message) { return send(message, replyTypeNone); }
  int sendReply(Message* message) { return send(message, replyTypeCompleteIO); }
  int send(Message* message, replyType reply);

  // Waits until the server is connected; false after the timeout [s].
  bool connectWait(double timeout);

  // Entries of device support tables.
  static long read_write(void* record);
  static long ioint(int cmd, dbCommon* record, IOSCANPVT* iopvt);
  static long linconv(void* record, int pass);

  IOSCANPVT ioscanpvt;
  bool iointValid;

 private:
  long completeIO(dbCommon* record, mpf::Message&& message) final;
  void receiveReply(dbCommon* record, mpf::Message&& message) final;
  void connectIO(dbCommon* record, const mpf::Connect& connect) final;
  void outOfBandIO(dbCommon* record, mpf::Message&& message) final;
  // The type of the request that the message belongs to.
  messageType takeSentType(const mpf::Message& message);

  bool isBound_ = false;
  // Types of requests with replyTypeReceiveReply that have not ended, by clientExtra.
  std::multimap<int32, messageType> sentTypes_;
};

// A device support table.
struct MPF_DSET {
  long number;
  long (*report)(int);
  long (*init)(int);
  long (*init_record)(void*);
  long (*get_ioint_info)(int, dbCommon*, IOSCANPVT*);
  long (*read_write)(void*);
  long (*linconv)(void*, int);
};

// Define and export a device support table. `init` is a long (*)(void*).
#define MPF_CLASSIC_DSET(name, init, number, convert)                                        \
  namespace {                                                                                \
  MPF_DSET name{number, nullptr, nullptr, init, DevMpf::ioint, DevMpf::read_write, convert}; \
  }                                                                                          \
  extern "C" {                                                                               \
  epicsExportAddress(dset, name);                                                            \
  }
#undef MAKE_LINCONV_DSET
#undef MAKE_DSET
#define MAKE_LINCONV_DSET(name, init) MPF_CLASSIC_DSET(name, init, 6, DevMpf::linconv)
#define MAKE_DSET(name, init) MPF_CLASSIC_DSET(name, init, 5, nullptr)

// NOLINTEND(readability-identifier-naming)
