// SPDX-License-Identifier: MIT
#include "epics/general/record_fields.h"

#include <algorithm>
#include <cstring>
#include <cvtTable.h>
#include <dbScan.h>
#include <limits>
#include <menuConvert.h>
#include <span>

#include "epics/linear_conversion.h"

namespace mpf::fields {
namespace {

// ---- numbers

// The value, or the bits of it that the link selects. In a record of 32 bits, the highest one is
// the sign, as in a message that it sends.
template <class Integer>
std::optional<Integer> selected(const Value& value, const Options& options) {
  if (options.selectsBits()) {
    const auto bits = toBits(value);
    if (!bits) return std::nullopt;
    return static_cast<Integer>((*bits & options.mask.value_or(UINT32_MAX)) >>
                                options.shift.value_or(0));
  }
  const auto integer = toInteger(value);
  return integer ? fit<Integer>(*integer) : std::nullopt;
}

// 32 bits, as the signed number of an Int32 message.
Value ofBits(std::uint32_t bits) { return std::int64_t{static_cast<std::int32_t>(bits)}; }

// nullopt: the number has bits that the link does not select.
std::optional<Value> placedInteger(std::int64_t number, const Options& options) {
  if (!options.selectsBits()) return number;
  const auto bits = toBits(number);
  if (!bits) return std::nullopt;
  const auto shift = options.shift.value_or(0);
  const auto placed = (*bits << shift) & options.mask.value_or(UINT32_MAX);
  return placed >> shift == *bits ? std::optional(ofBits(placed)) : std::nullopt;
}

// Record support would replace another value that was read back by the limit.
template <class Record>
bool isWithinDriveLimits(const Record& record, decltype(record.val) number) {
  if constexpr (requires { record.drvh; })
    return record.drvh <= record.drvl || !(number < record.drvl || number > record.drvh);
  else return true;
}

template <class Record>
Stored storeInteger(Record& record, const Value& value, const Options& options) {
  const auto number = selected<decltype(record.val)>(value, options);
  if (!number || !isWithinDriveLimits(record, *number)) return Stored::doesNotFit;
  record.val = *number;
  record.udf = FALSE;
  return Stored::done;
}

// Integers are raw values; other numbers are in engineering units.
bool isRaw(const Value& value) noexcept {
  return std::holds_alternative<std::int64_t>(value) ||
         std::holds_alternative<std::span<const std::int32_t>>(value);
}

template <class Record>
double adjusted(const Record& record, double number) {
  return (record.aslo == 0 ? number : number * record.aslo) + record.aoff;
}

template <class Record>
void setSlope(Record& record, const Options& options) {
  if (!options.range) return;
  setLinearConversion(record, options.range->low, options.range->high);
}

double engineeringOfRaw(aoRecord& record, std::int32_t raw) {
  double number = adjusted(record, static_cast<double>(raw) + record.roff);
  if (record.linr == menuConvertNO_CONVERSION) return number;
  if (record.linr == menuConvertLINEAR || record.linr == menuConvertSLOPE)
    return number * record.eslo + record.eoff;
  cvtRawToEngBpt(&number, static_cast<short>(record.linr), record.init, &record.pbrk, &record.lbrk);
  return number;
}

// RVAL as a number without limits; RVAL itself is the largest or the smallest integer instead.
double rawOf(const aoRecord& record) {
  double number = record.oval;
  if (record.linr == menuConvertLINEAR || record.linr == menuConvertSLOPE) {
    number = record.eslo == 0 ? 0 : (number - record.eoff) / record.eslo;
  } else if (record.linr != menuConvertNO_CONVERSION) {
    void* table = record.pbrk;
    short at = record.lbrk;
    cvtEngToRawBpt(&number, static_cast<short>(record.linr), record.init, &table, &at);
  }
  return (number - record.aoff) / (record.aslo == 0 ? 1 : record.aslo) - record.roff;
}

// ---- bits

template <class Record>
std::uint32_t masked(const Record& record, std::uint32_t bits) {
  return record.mask == 0 ? bits : bits & record.mask;
}

template <class Record>
Stored storeBits(Record& record, const Value& value) {
  const auto bits = toBits(value);
  if (!bits) return Stored::doesNotFit;
  record.rval = masked(record, *bits);
  record.udf = FALSE;
  return Stored::done;
}

template <class Record>
void setBitMask(Record& record, const Options& options) {
  if (options.mask) record.mask = *options.mask;
  else if (options.shift) record.mask = epicsUInt32{1} << *options.shift;
}

template <class Record>
void setFieldMask(Record& record, const Options& options) {
  if (options.shift) record.shft = static_cast<epicsUInt16>(*options.shift);
  if (options.mask) record.mask = *options.mask;
  else record.mask = (record.mask == 0 ? UINT32_MAX : record.mask) << std::min(+record.shft, 31);
}

template <class Record>
std::uint32_t unshifted(const Record& record, std::uint32_t raw) {
  return record.shft > 31 ? 0 : raw >> record.shft;
}

// The state that has this value; without values of states, its number.
std::optional<epicsEnum16> stateOf(const mbboRecord& record, std::uint32_t value) {
  constexpr std::uint32_t kUnknownState = 65535;
  if (record.sdef == FALSE)
    return value < kUnknownState ? std::optional(static_cast<epicsEnum16>(value)) : std::nullopt;
  const std::span states(&record.zrvl, 16);
  const auto found = std::ranges::find(states, value);
  if (found == states.end()) return std::nullopt;
  return static_cast<epicsEnum16>(found - states.begin());
}

// ---- text

template <std::size_t size>
Stored storeText(char (&field)[size], const Value& value) {
  const auto text = toText(value);
  if (!text) return Stored::doesNotFit;
  field[text->copy(field, size - 1)] = '\0';
  return text->size() < size ? Stored::done : Stored::truncated;
}

template <class Record>
Stored storeLongText(Record& record, const Value& value) {
  const auto text = toText(value);
  if (!text || record.sizv == 0) return Stored::doesNotFit;
  const auto length = text->copy(record.val, record.sizv - 1U);
  record.val[length] = '\0';
  record.len = static_cast<epicsUInt32>(length + 1);
  record.udf = FALSE;
  return length == text->size() ? Stored::done : Stored::truncated;
}

// ---- arrays

template <class Record>
Stored storeArray(Record& record, const Value& value) {
  std::uint32_t used = 0;
  const auto stored = storeElements(value, record.ftvl, record.bptr, record.nelm, used);
  if (stored == Stored::doesNotFit) return stored;
  record.nord = used;
  record.udf = FALSE;
  return stored;
}

}  // namespace

// ---- numbers

Stored store(aiRecord& record, const Value& value, const Options& options) {
  if (isRaw(value)) {
    const auto raw = selected<epicsInt32>(value, options);
    if (!raw) return Stored::doesNotFit;
    record.rval = *raw;
    return Stored::done;
  }
  const auto number = toDouble(value);
  if (!number) return Stored::doesNotFit;
  const double sample = adjusted(record, *number);
  const bool isSmooth =
      record.smoo != 0 && record.udf == FALSE && std::isfinite(record.val) && std::isfinite(sample);
  record.val = isSmooth ? record.val * record.smoo + sample * (1 - record.smoo) : sample;
  record.udf = std::isnan(record.val);
  return Stored::converted;
}

Stored store(aoRecord& record, const Value& value, const Options& options) {
  std::optional<double> number;
  if (isRaw(value)) {
    const auto raw = selected<epicsInt32>(value, options);
    if (raw) number = engineeringOfRaw(record, *raw);
  } else if (const auto sample = toDouble(value)) {
    number = adjusted(record, *sample);
  }
  if (!number || !isWithinDriveLimits(record, *number)) return Stored::doesNotFit;
  record.val = record.oval = record.pval = *number;
  record.udf = std::isnan(*number);
  return Stored::done;
}

Stored store(longinRecord& record, const Value& value, const Options& options) {
  return storeInteger(record, value, options);
}
Stored store(longoutRecord& record, const Value& value, const Options& options) {
  return storeInteger(record, value, options);
}
Stored store(int64inRecord& record, const Value& value, const Options& options) {
  return storeInteger(record, value, options);
}
Stored store(int64outRecord& record, const Value& value, const Options& options) {
  return storeInteger(record, value, options);
}

std::optional<Value> load(const aoRecord& record, const Options& options, Scratch& /*scratch*/) {
  if (options.type == MessageType::int32 || options.type == MessageType::int32Array)
    return fit<epicsInt32>(rawOf(record)) ? placedInteger(record.rval, options) : std::nullopt;
  return (record.oval - record.aoff) / (record.aslo == 0 ? 1 : record.aslo);
}
std::optional<Value> load(const longoutRecord& record, const Options& options,
                          Scratch& /*scratch*/) {
  return placedInteger(record.val, options);
}
std::optional<Value> load(const int64outRecord& record, const Options& options,
                          Scratch& /*scratch*/) {
  return placedInteger(record.val, options);
}

void prepare(aiRecord& record, const Options& options) { setSlope(record, options); }
void prepare(aoRecord& record, const Options& options) { setSlope(record, options); }

// ---- bits

Stored store(biRecord& record, const Value& value, const Options& /*options*/) {
  return storeBits(record, value);
}
Stored store(mbbiRecord& record, const Value& value, const Options& /*options*/) {
  return storeBits(record, value);
}
Stored store(mbbiDirectRecord& record, const Value& value, const Options& /*options*/) {
  return storeBits(record, value);
}
Stored store(boRecord& record, const Value& value, const Options& /*options*/) {
  const auto stored = storeBits(record, value);
  if (stored == Stored::done) record.val = record.rval != 0 ? 1 : 0;
  return stored;
}
Stored store(mbboRecord& record, const Value& value, const Options& /*options*/) {
  const auto bits = toBits(value);
  if (!bits) return Stored::doesNotFit;
  const auto raw = masked(record, *bits);
  const auto state = stateOf(record, unshifted(record, raw));
  if (!state) return Stored::doesNotFit;
  record.rval = raw;
  record.val = *state;
  record.udf = FALSE;
  return Stored::done;
}
Stored store(mbboDirectRecord& record, const Value& value, const Options& /*options*/) {
  const auto stored = storeBits(record, value);
  if (stored != Stored::done) return stored;
  record.val = static_cast<epicsInt32>(unshifted(record, record.rval));
  constexpr int kBits = 32;
  for (int bit = 0; bit < kBits; ++bit)
    (&record.b0)[bit] = (static_cast<epicsUInt32>(record.val) >> bit) & 1;
  return stored;
}

Value load(const boRecord& record, const Options& /*options*/, Scratch& /*scratch*/) {
  return ofBits(record.rval);
}
Value load(const mbboRecord& record, const Options& /*options*/, Scratch& /*scratch*/) {
  return ofBits(record.rval & record.mask);
}
Value load(const mbboDirectRecord& record, const Options& /*options*/, Scratch& /*scratch*/) {
  return ofBits(record.rval & record.mask);
}

void prepare(biRecord& record, const Options& options) { setBitMask(record, options); }
void prepare(boRecord& record, const Options& options) { setBitMask(record, options); }
void prepare(mbbiRecord& record, const Options& options) { setFieldMask(record, options); }
void prepare(mbboRecord& record, const Options& options) { setFieldMask(record, options); }
void prepare(mbbiDirectRecord& record, const Options& options) { setFieldMask(record, options); }
void prepare(mbboDirectRecord& record, const Options& options) { setFieldMask(record, options); }

// ---- text

Stored store(stringinRecord& record, const Value& value, const Options& /*options*/) {
  const auto stored = storeText(record.val, value);
  if (stored != Stored::doesNotFit) record.udf = FALSE;
  return stored;
}
Stored store(stringoutRecord& record, const Value& value, const Options& /*options*/) {
  const auto stored = storeText(record.val, value);
  if (stored != Stored::doesNotFit) record.udf = FALSE;
  return stored;
}
Stored store(lsiRecord& record, const Value& value, const Options& /*options*/) {
  return storeLongText(record, value);
}
Stored store(lsoRecord& record, const Value& value, const Options& /*options*/) {
  return storeLongText(record, value);
}
Stored store(eventRecord& record, const Value& value, const Options& /*options*/) {
  const auto stored = storeText(record.val, value);
  if (stored == Stored::doesNotFit) return stored;
  record.epvt = eventNameToHandle(record.val);
  record.udf = FALSE;
  return stored;
}

Value load(const stringoutRecord& record, const Options& /*options*/, Scratch& /*scratch*/) {
  return std::string_view(record.val, ::strnlen(record.val, sizeof record.val));
}
Value load(const lsoRecord& record, const Options& /*options*/, Scratch& /*scratch*/) {
  return std::string_view(record.val, ::strnlen(record.val, record.sizv));
}

// ---- arrays

Stored store(waveformRecord& record, const Value& value, const Options& /*options*/) {
  return storeArray(record, value);
}
Stored store(aaiRecord& record, const Value& value, const Options& /*options*/) {
  return storeArray(record, value);
}
Stored store(aaoRecord& record, const Value& value, const Options& /*options*/) {
  return storeArray(record, value);
}
std::optional<Value> load(const aaoRecord& record, const Options& /*options*/, Scratch& scratch) {
  return loadElements(record.ftvl, record.bptr, record.nord, scratch);
}

}  // namespace mpf::fields
