// SPDX-License-Identifier: MIT
// GeneralDevice: device support with DTYP "MPF" for a record of any type. The link says which
// messages the record sends; RecordAccess says how they are converted.
//
//   read       processes ─► startIO ─ request ─► PACT ── reply ──► completeIO: stores the value
//   write      processes ─► startIO ─ value ───► PACT ── reply ──► completeIO: looks at the status
//   subscribe  connected ─► request             each message ─► receiveReply ─► processes: stores
//   readback   connected, until a reply ─► request     reply ─► receiveReply: stores ─► processes
//              without DOL and without a write
//
//   subscription:  none ── request sent ──► requested ── disconnected, refused ──► none
//
// A request to subscribe or to read back that the server has not received in time is sent again.
// A record that subscribes is not active while it waits, so that the first message may come at any
// time. When it processes for another reason, it keeps its value and its alarm.
//
// Threads  as DevMpf: all functions run with the record locked.
// Errors   a link with an invalid key or value: a message, and the record never processes. A reply
//          with a status other than 0 or a value that does not fit: READ or WRITE, INVALID, and the
//          field keeps its value. More elements or text than the field has room for: READ, MINOR.
#pragma once

#include <dbCommon.h>
#include <link.h>
#include <optional>
#include <vector>

#include <mpf/epics/dev_mpf.h>

#include "epics/general/link_options.h"
#include "epics/general/message_value.h"

namespace mpf {

// What GeneralDevice needs from a record type. An input record has no `load`; `store` of an output
// record takes the value that was read back.
struct RecordAccess {
  // The type of messages unless the link has one; none when the record can have no value.
  MessageType (*type)(const dbCommon*);
  bool canHaveBits;  // mask= and shift= of the link
  bool canHaveRange;  // range= of the link
  // Sets fields of the record that follow from the link.
  void (*prepare)(dbCommon*, const LinkOptions&);
  Stored (*store)(dbCommon*, const MessageValue&, const LinkOptions&);
  //   scratch  holds the value when it has no field
  //   returns  nullopt when a conversion or the bits of the link would change the value
  std::optional<MessageValue> (*load)(const dbCommon*, const LinkOptions&,
                                      std::vector<double>& scratch);
  // OMSL of an output record.
  epicsEnum16* (*outputMode)(dbCommon*);
  // Whether SMOO would change VAL each time that the record converts RVAL.
  bool (*isSmoothed)(const dbCommon*);

  [[nodiscard]] bool isOutput() const noexcept { return load != nullptr; }
};

class GeneralDevice final : public DevMpf {
 public:
  GeneralDevice(dbCommon* record, DBLINK* link, const RecordAccess& access,
                const LinkOptions& options);

  // For init_record(): the device support of a record.
  //   access   lives until the IOC ends
  //   returns  0, or S_db_badField after a message with the reason; then the record is disabled
  static long init(dbCommon* record, DBLINK* link, const RecordAccess& access);

  long startIO(dbCommon* record) override;
  long completeIO(dbCommon* record, Message&& message) override;
  void receiveReply(dbCommon* record, Message&& message) override;
  void connectIO(dbCommon* record, const Connect& connect) override;
  long convert(dbCommon* record, int pass) override;

 private:
  enum class Subscription { none, requested };

  long write(dbCommon* record);
  // Sends a request whose replies arrive at receiveReply().
  long query(std::int32_t cmd);
  void subscribe();
  // Stores the value of a message in the record, or sets an alarm.
  long take(dbCommon* record, const Message& message);
  long repeatResult(dbCommon* record);
  // The result when the record processes without a message: it keeps its value.
  long keepValue(dbCommon* record);
  void takeReadback(dbCommon* record, const Message& message);
  // Processes the record with the value that was read back; endReadback() stands for the write.
  void showReadback(dbCommon* record);
  long endReadback(dbCommon* record);
  long failStatus(dbCommon* record, std::int32_t status);
  void connectOutput(dbCommon* record);

  const RecordAccess& access_;
  const LinkOptions options_;
  Subscription subscription_ = Subscription::none;
  bool hasConnected_ = false;
  bool hasReadBack_ = false;
  bool hasWritten_ = false;
  std::optional<Message> pending_;  // the message that the record processes next
  // the result of the last message of a subscription, or of a value that was read back until the
  // record has processed with it; none: failed
  std::optional<Stored> stored_;
  std::vector<double> scratch_;
};

}  // namespace mpf
