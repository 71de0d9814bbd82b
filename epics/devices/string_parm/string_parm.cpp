// SPDX-License-Identifier: MIT
// Device support "Hideos <ai, ao, bi, li, lo, si or so> stringParm": a record reads or writes one
// text; string_parameters.h describes its link.
//
//   ai, longin   FMT, or DESC unless it is empty, is a scanf format
//   bi           0STR and 1STR are compared first; then FMT scans a number
//   ao, longout  FMT, or DESC unless it is empty, is a printf format
//   stringin, stringout  the text itself
//
// An input record without an answer, or with another one than its format, is undefined (UDF alarm).
// Without a terminator the answer ends with the timeout, which is no error then.
//
// Source  the EPICS module ip, README.devXxStrParm.
#include <aiRecord.h>
#include <aoRecord.h>
#include <biRecord.h>
#include <cstring>
#include <longinRecord.h>
#include <longoutRecord.h>
#include <stringinRecord.h>
#include <stringoutRecord.h>

#include "epics/common_fields.h"
#include "epics/devices/string_parm/string_parameters.h"
#include "epics/devices/string_parm/text_device.h"
#include "epics/devices/string_parm/value_format.h"

namespace mpf {
namespace {

using namespace std::chrono_literals;

// FMT, else DESC, else `standard`.
std::string formatOf(const StringParameters& parameters, const dbCommon* record,
                     const char* standard) {
  if (parameters.format) return *parameters.format;
  return record->desc[0] != '\0' ? record->desc : standard;
}

// ---- input records

template <class Record>
class StringInput : public TextDevice {
 public:
  explicit StringInput(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->inp) {}
  long startIO(dbCommon*) override {
    return sendText({.cmd = serial::cmdRead,
                     .timeout = parameters_.timeout,
                     .maxBytes = parameters_.maxBytes,
                     .eom = parameters_.terminator});
  }

  static long init(dbCommon* common, std::unique_ptr<StringInput> device) {
    try {
      device->parameters_ =
          StringParameters::parse(device->getUserParm(), device->getSignal(), 1000ms);
      device->configure(*reinterpret_cast<Record*>(common), device->parameters_);
    } catch (const std::exception& error) {
      refuseLink(*device, common, "INP", error.what());
    }
    auto* bound = device.release();  // the record owns it
    bound->bind();
    return bound->getStatus();
  }

 protected:
  virtual void configure(const Record&, const StringParameters&) {}
  //   returns  false when the text is not a value
  virtual bool store(Record& record, const std::string& text) = 0;
  virtual void clear(Record& record) = 0;

 private:
  long takeAnswer(dbCommon* common, TextAnswer answer) final {
    auto& record = *reinterpret_cast<Record*>(common);
    const bool isFailed =
        answer.status != serial::serialServerStatusOK && !parameters_.terminator.empty();
    const auto text = isFailed ? std::nullopt : parameters_.textOf(answer.text);
    if (!text) {
      clear(record);
      setUndefined(common, isFailed ? reasonOf(answer.status) : "the answer is too short");
    } else if (store(record, *text)) {
      common->udf = FALSE;
    } else {
      setUndefined(common, "the answer does not match FMT");
    }
    return MPF_NoConvert;
  }
  StringParameters parameters_;
};

// ai and longin.
template <class Record, class Value>
class NumberInput final : public StringInput<Record> {
 public:
  using StringInput<Record>::StringInput;
  static constexpr bool isFloating = std::is_same_v<Value, double>;
  static long init(dbCommon* record) {
    return StringInput<Record>::init(
        record, std::make_unique<NumberInput>(reinterpret_cast<Record*>(record)));
  }

 private:
  void configure(const Record& record, const StringParameters& parameters) override {
    const auto* common = reinterpret_cast<const dbCommon*>(&record);
    format_.emplace(formatOf(parameters, common, isFloating ? "%lf" : "%ld"), FormatUse::scan);
  }
  bool store(Record& record, const std::string& text) override {
    const auto value = format_->scan(text);
    if (value) record.val = *value;
    return value.has_value();
  }
  void clear(Record& record) override { record.val = 0; }
  std::optional<ValueFormat<Value>> format_;
};

class BinaryInput final : public StringInput<biRecord> {
 public:
  using StringInput::StringInput;
  static long init(dbCommon* record) {
    return StringInput::init(record,
                             std::make_unique<BinaryInput>(reinterpret_cast<biRecord*>(record)));
  }

 private:
  void configure(const biRecord& record, const StringParameters& parameters) override {
    zero_ = parameters.zero;
    one_ = parameters.one;
    const auto* common = reinterpret_cast<const dbCommon*>(&record);
    const bool isText = !parameters.format && !(zero_.empty() && one_.empty());
    format_.emplace(isText ? "%d" : formatOf(parameters, common, "%d"), FormatUse::scan);
  }
  bool store(biRecord& record, const std::string& text) override {
    std::optional<std::int32_t> value;
    if (!zero_.empty() && text.starts_with(zero_)) value = 0;
    else if (!one_.empty() && text.starts_with(one_)) value = 1;
    else value = format_->scan(text);
    if (value) record.val = *value != 0 ? 1 : 0;
    return value.has_value();
  }
  void clear(biRecord& record) override { record.val = 0; }
  std::string zero_, one_;
  std::optional<ValueFormat<std::int32_t>> format_;
};

class TextInput final : public StringInput<stringinRecord> {
 public:
  using StringInput::StringInput;
  static long init(dbCommon* record) {
    return StringInput::init(
        record, std::make_unique<TextInput>(reinterpret_cast<stringinRecord*>(record)));
  }

 private:
  bool store(stringinRecord& record, const std::string& text) override {
    record.val[text.copy(record.val, sizeof record.val - 1)] = '\0';
    return true;
  }
  void clear(stringinRecord& record) override { record.val[0] = '\0'; }
};

// ---- output records

template <class Record>
class StringOutput : public TextDevice {
 public:
  explicit StringOutput(Record* record)
      : TextDevice(reinterpret_cast<dbCommon*>(record), &record->out) {}
  long startIO(dbCommon* common) override {
    const auto text = textOf(*reinterpret_cast<Record*>(common)) + parameters_.terminator;
    return sendText({.cmd = serial::cmdWrite, .text = text, .timeout = parameters_.timeout});
  }
  // MPF_NoConvert keeps the VAL of the database: the output is not read back.
  static long init(dbCommon* common, std::unique_ptr<StringOutput> device) {
    try {
      device->parameters_ =
          StringParameters::parse(device->getUserParm(), device->getSignal(), 3000ms);
      device->configure(*reinterpret_cast<Record*>(common));
    } catch (const std::exception& error) {
      refuseLink(*device, common, "OUT", error.what());
    }
    auto* bound = device.release();  // the record owns it
    bound->bind();
    return bound->getStatus() == 0 ? MPF_NoConvert : bound->getStatus();
  }

 protected:
  virtual void configure(const Record&) {}
  [[nodiscard]] virtual std::string textOf(const Record& record) const = 0;
  [[nodiscard]] const StringParameters& parameters() const { return parameters_; }

 private:
  long takeAnswer(dbCommon* record, TextAnswer answer) final {
    return takeWriteStatus(*this, record, answer.status);
  }
  StringParameters parameters_;
};

// ao and longout.
template <class Record, class Value>
class NumberOutput final : public StringOutput<Record> {
 public:
  using StringOutput<Record>::StringOutput;
  static constexpr bool isFloating = std::is_same_v<Value, double>;
  static long init(dbCommon* record) {
    return StringOutput<Record>::init(
        record, std::make_unique<NumberOutput>(reinterpret_cast<Record*>(record)));
  }

 private:
  void configure(const Record& record) override {
    const auto* common = reinterpret_cast<const dbCommon*>(&record);
    format_.emplace(formatOf(this->parameters(), common, isFloating ? "%f" : "%ld"),
                    FormatUse::print);
  }
  [[nodiscard]] std::string textOf(const Record& record) const override {
    return format_->print(record.val);
  }
  std::optional<ValueFormat<Value>> format_;
};

class TextOutput final : public StringOutput<stringoutRecord> {
 public:
  using StringOutput::StringOutput;
  static long init(dbCommon* record) {
    return StringOutput::init(
        record, std::make_unique<TextOutput>(reinterpret_cast<stringoutRecord*>(record)));
  }

 private:
  [[nodiscard]] std::string textOf(const stringoutRecord& record) const override {
    const std::string_view text(record.val, ::strnlen(record.val, sizeof record.val));
    return std::string(text.substr(std::min(parameters().index, text.size())));
  }
};

using AnalogInput = NumberInput<aiRecord, double>;
using LongInput = NumberInput<longinRecord, std::int32_t>;
using AnalogOutput = NumberOutput<aoRecord, double>;
using LongOutput = NumberOutput<longoutRecord, std::int32_t>;

}  // namespace

MAKE_LINCONV_DSET(devAiStrParm, AnalogInput::init)
MAKE_LINCONV_DSET(devAoStrParm, AnalogOutput::init)
MAKE_DSET(devBiStrParm, BinaryInput::init)
MAKE_DSET(devLiStrParm, LongInput::init)
MAKE_DSET(devLoStrParm, LongOutput::init)
MAKE_DSET(devSiStrParm, TextInput::init)
MAKE_DSET(devSoStrParm, TextOutput::init)

}  // namespace mpf
