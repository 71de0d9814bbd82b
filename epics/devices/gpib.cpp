// SPDX-License-Identifier: MIT
// Device support "GPIB (NI or HIDEOS)": records and instruments at GPIB servers.
//
//   INP  "#L<link> A<address> @<question>"   ai, longin, stringin, lsi: writes the question and
//                                            reads the answer; without a question it only reads
//   OUT  "#L<link> A<address> @<format>"     ao, longout: a printf format for the value, default
//                                            %.15g and %d
//                                            stringout, lso: text with %s at the place of the value
//
// HiDEOSGpibLinkConfig gives a link its server (gpib_links.h). <address> is the primary address, or
// 100 * primary + secondary address. Escapes in questions and formats are translated
// ("\\n" in a database file is a line feed), and nothing is appended. An answer ends with END; its
// final CR and LF are removed. The value of ai and longin is the first number of the answer, of a
// longin rounded to the nearest integer. The server waits at most 5 s.
//
// Source  drvGpib of EPICS Base 3.13 for links and DTYP; the parameters are of this project.
#include <aiRecord.h>
#include <aoRecord.h>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <longinRecord.h>
#include <longoutRecord.h>
#include <lsiRecord.h>
#include <lsoRecord.h>
#include <stdexcept>
#include <stringinRecord.h>
#include <stringoutRecord.h>

#include <mpf/gpib_commands.h>

#include "epics/common_fields.h"
#include "epics/devices/string_parm/text_device.h"
#include "epics/devices/string_parm/value_format.h"
#include "epics/devices/text_fields.h"
#include "epics/general/message_value.h"

namespace mpf {
namespace {

const char* reasonOf(std::int32_t status) noexcept {
  switch (status) {
    case gpib::gpibStatusTimeout:
      return "timeout of the GPIB instrument";
    case gpib::gpibStatusOverflow:
      return "the answer is longer than the buffer";
    case gpib::gpibStatusNoListener:
      return "no GPIB instrument at this address";
    case gpib::gpibStatusLeased:
      return "another program has the GPIB bus";
    case gpib::gpibStatusInvalid:
      return "the server refuses address or text";
    default:
      return "error of the GPIB bus";
  }
}

// ---- the fields of each record type

// Functions that store an answer return the reason if they cannot; nullptr: stored.
template <class StringRecord>
const char* store(StringRecord& record, const std::string& text) {
  setValue(record, text);
  return nullptr;
}
constexpr const char* kDoesNotFit = "the value does not fit the record";
// The first number in the text.
template <class Number>
const char* storeNumber(Number& field, const std::string& text) {
  constexpr auto* kFirst = "+-.0123456789";
  for (auto at = text.find_first_of(kFirst); at != std::string::npos;
       at = text.find_first_of(kFirst, at + 1)) {
    char* end = nullptr;
    errno = 0;
    const auto value = std::strtod(text.c_str() + at, &end);
    if (end == text.c_str() + at) continue;
    const auto number = fit<Number>(value);
    if (!number || (errno == ERANGE && std::isinf(value))) return kDoesNotFit;
    field = *number;
    return nullptr;
  }
  return "the answer has no number";
}
const char* store(aiRecord& record, const std::string& text) {
  return storeNumber(record.val, text);
}
const char* store(longinRecord& record, const std::string& text) {
  return storeNumber(record.val, text);
}

std::string printed(const aoRecord& record, const std::string& format) {
  return ValueFormat<double>(format.empty() ? "%.15g" : format, FormatUse::print)
      .print(record.oval);
}
std::string printed(const longoutRecord& record, const std::string& format) {
  return ValueFormat<std::int32_t>(format.empty() ? "%d" : format, FormatUse::print)
      .print(record.val);
}
std::string inserted(std::string_view value, std::string format) {
  if (format.empty()) return std::string(value);
  const auto place = format.find("%s");
  if (place == std::string::npos) throw std::invalid_argument("the format has no %s");
  return format.replace(place, 2, value);
}
std::string printed(const stringoutRecord& record, const std::string& format) {
  return inserted(valueOf(record), format);
}
std::string printed(const lsoRecord& record, const std::string& format) {
  return inserted(valueOf(record), format);
}

template <class Record>
class GpibInput final : public TextDevice {
 public:
  explicit GpibInput(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->inp),
        question_(translated(getUserParm())) {}
  long startIO(dbCommon*) override {
    return sendText({.cmd = question_.empty() ? gpib::cmdRead : gpib::cmdWriteRead,
                     .text = question_,
                     .address = getSignal()});
  }
  static long init(dbCommon* record) {
    return bindDevice<GpibInput>(reinterpret_cast<Record*>(record));
  }

 private:
  long takeAnswer(dbCommon* common, TextAnswer answer) override {
    if (answer.status != gpib::gpibStatusOK) return fail(common, reasonOf(answer.status));
    const std::string text(withoutLineEnd(answer.text));
    if (const auto* reason = store(*reinterpret_cast<Record*>(common), text))
      return fail(common, reason);
    common->udf = FALSE;
    return MPF_NoConvert;
  }
  const std::string question_;
};

template <class Record>
class GpibOutput final : public TextDevice {
 public:
  explicit GpibOutput(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->out),
        format_(translated(getUserParm())) {
    try {
      static_cast<void>(printed(*record, format_));
    } catch (const std::exception& error) {
      refuseLink(*this, reinterpret_cast<dbCommon*>(record), "OUT", error.what());
    }
  }
  long startIO(dbCommon* common) override {
    const auto text = printed(*reinterpret_cast<Record*>(common), format_);
    return sendText({.cmd = gpib::cmdWrite, .text = text, .address = getSignal()});
  }
  // MPF_NoConvert keeps the VAL of the database: the output is not read back.
  static long init(dbCommon* record) {
    const auto status = bindDevice<GpibOutput>(reinterpret_cast<Record*>(record));
    return status == 0 && std::is_same_v<Record, aoRecord> ? MPF_NoConvert : status;
  }

 private:
  long takeAnswer(dbCommon* common, TextAnswer answer) override {
    return answer.status == gpib::gpibStatusOK ? MPF_OK : fail(common, reasonOf(answer.status));
  }
  const std::string format_;
};

}  // namespace

MAKE_LINCONV_DSET(devAiGpib, GpibInput<aiRecord>::init)
MAKE_LINCONV_DSET(devAoGpib, GpibOutput<aoRecord>::init)
MAKE_DSET(devLiGpib, GpibInput<longinRecord>::init)
MAKE_DSET(devLoGpib, GpibOutput<longoutRecord>::init)
MAKE_DSET(devSiGpib, GpibInput<stringinRecord>::init)
MAKE_DSET(devSoGpib, GpibOutput<stringoutRecord>::init)
MAKE_DSET(devLsiGpib, GpibInput<lsiRecord>::init)
MAKE_DSET(devLsoGpib, GpibOutput<lsoRecord>::init)

}  // namespace mpf
