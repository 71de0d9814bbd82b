// SPDX-License-Identifier: MIT
// Device support that exchanges plain text with a server.
//
//   stringin, lsi   "MPFwriteRead"  INP "#C<location> S0 @<server>,<field>": writes the string of
//                                   the field of another record, and reads the answer
//   stringin, lsi   "MPFread"       INP "#C<location> S0 @<server>": reads
//   stringout, lso  "MPFwrite"      OUT "#C<location> S0 @<server>": writes
//
// Escapes in a string that is written, such as \r, are translated; nothing is appended. An answer
// ends as the server decides; its final CR and LF are removed. The server waits at most 5 s.
//
// Source  manual, "devStringMpf".
#include <array>
#include <cstring>
#include <dbFldTypes.h>
#include <dbLink.h>
#include <lsiRecord.h>
#include <lsoRecord.h>
#include <span>
#include <stringinRecord.h>
#include <stringoutRecord.h>
#include <vector>

#include "epics/common_fields.h"
#include "epics/devices/string_parm/text_device.h"
#include "epics/devices/text_fields.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxText = 32767;  // as the longest VAL of lsi and lso

// A link of device support to a field; reading it is part of the processing of the record.
class FieldLink {
 public:
  FieldLink(dbCommon* record, std::string field) : field_(std::move(field)) {
    link_.precord = record;
    link_.type = PV_LINK;
    link_.value.pv_link.pvname = field_.data();
    dbInitLink(&link_, DBF_INLINK);
  }
  [[nodiscard]] std::optional<std::string> read() {
    // Of a field of CHARs without elements, Base sets the byte before the buffer to 0.
    std::vector<char> memory(kMaxText + 2);
    const auto text = std::span(memory).subspan(1);
    epicsUInt32 size = 0;
    if (dbGetLinkLS(&link_, text.data(), static_cast<epicsUInt32>(text.size()), &size) != 0)
      return std::nullopt;
    return std::string(text.data(), ::strnlen(text.data(), text.size()));
  }

 private:
  std::string field_;
  DBLINK link_{};
};

template <class Record>
class TextReader : public TextDevice {
 public:
  explicit TextReader(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->inp) {}
  long startIO(dbCommon*) override { return sendText({.cmd = serial::cmdRead}); }
  static long init(dbCommon* record) {
    return bindDevice<TextReader>(reinterpret_cast<Record*>(record));
  }

 private:
  long takeAnswer(dbCommon* common, TextAnswer answer) final {
    if (answer.status != serial::serialServerStatusOK) return fail(common, reasonOf(answer.status));
    setValue(*reinterpret_cast<Record*>(common), withoutLineEnd(answer.text));
    common->udf = FALSE;
    return MPF_OK;
  }
};

template <class Record>
class TextWriterReader final : public TextReader<Record> {
 public:
  explicit TextWriterReader(Record* record) : TextReader<Record>(record) {
    auto* common = reinterpret_cast<dbCommon*>(record);
    const std::string field = this->getUserParm();
    if (field.empty()) refuseLink(*this, common, "INP", "use @<server>,<field to write>");
    else field_.emplace(common, field);
  }
  long startIO(dbCommon* common) override {
    const auto text = field_->read();
    if (!text) return this->fail(common, "cannot read the string to write");
    return this->sendText(
        {.cmd = serial::cmdWriteRead | serial::cmdFlush, .text = translated(*text)});
  }
  static long init(dbCommon* record) {
    return bindDevice<TextWriterReader>(reinterpret_cast<Record*>(record));
  }

 private:
  std::optional<FieldLink> field_;
};

template <class Record>
class TextWriter final : public TextDevice {
 public:
  explicit TextWriter(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->out) {}
  long startIO(dbCommon* common) override {
    const auto text = translated(valueOf(*reinterpret_cast<Record*>(common)));
    return sendText({.cmd = serial::cmdWrite, .text = text});
  }
  static long init(dbCommon* record) {
    return bindDevice<TextWriter>(reinterpret_cast<Record*>(record));
  }

 private:
  long takeAnswer(dbCommon* record, TextAnswer answer) final {
    return takeWriteStatus(*this, record, answer.status);
  }
};

}  // namespace

MAKE_DSET(devSiMpfWriteRead, TextWriterReader<stringinRecord>::init)
MAKE_DSET(devSiMpfRead, TextReader<stringinRecord>::init)
MAKE_DSET(devSoMpfWrite, TextWriter<stringoutRecord>::init)
MAKE_DSET(devLsiMpfWriteRead, TextWriterReader<lsiRecord>::init)
MAKE_DSET(devLsiMpfRead, TextReader<lsiRecord>::init)
MAKE_DSET(devLsoMpfWrite, TextWriter<lsoRecord>::init)

}  // namespace mpf
