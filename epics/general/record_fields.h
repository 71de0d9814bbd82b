// SPDX-License-Identifier: MIT
// Functions that move values between messages and the fields of each record type, for the table of
// record_types.cpp.
//
//   prepare(record, options)          sets MASK, SHFT, ESLO and EOFF as the link says
//   store(record, value, options)     input records, and outputs that are read back
//   load(record, options, scratch)    output records; nullopt: the value does not fit
//
// Bits: RVAL of a bit record is the value & MASK, as with "Raw Soft Channel". A mask= of the link
// is MASK itself; without one, the bits of MASK of the database, or else NOBT bits, from bit SHFT
// on. A longin and its kin with a mask= or shift= have the selected bits as VAL:
// (value & mask) >> shift. A value with other bits does not fit.
#pragma once

#include <aaiRecord.h>
#include <aaoRecord.h>
#include <aiRecord.h>
#include <aoRecord.h>
#include <biRecord.h>
#include <boRecord.h>
#include <eventRecord.h>
#include <int64inRecord.h>
#include <int64outRecord.h>
#include <longinRecord.h>
#include <longoutRecord.h>
#include <lsiRecord.h>
#include <lsoRecord.h>
#include <mbbiDirectRecord.h>
#include <mbbiRecord.h>
#include <mbboDirectRecord.h>
#include <mbboRecord.h>
#include <optional>
#include <stringinRecord.h>
#include <stringoutRecord.h>
#include <vector>
#include <waveformRecord.h>

#include "epics/general/link_options.h"
#include "epics/general/message_value.h"

namespace mpf::fields {

using Options = LinkOptions;
using Value = MessageValue;
using Scratch = std::vector<double>;

// ---- numbers
Stored store(aiRecord& record, const Value& value, const Options& options);
Stored store(aoRecord& record, const Value& value, const Options& options);
Stored store(longinRecord& record, const Value& value, const Options& options);
Stored store(longoutRecord& record, const Value& value, const Options& options);
Stored store(int64inRecord& record, const Value& value, const Options& options);
Stored store(int64outRecord& record, const Value& value, const Options& options);
std::optional<Value> load(const aoRecord& record, const Options& options, Scratch& scratch);
std::optional<Value> load(const longoutRecord& record, const Options& options, Scratch& scratch);
std::optional<Value> load(const int64outRecord& record, const Options& options, Scratch& scratch);
void prepare(aiRecord& record, const Options& options);
void prepare(aoRecord& record, const Options& options);

// ---- bits
Stored store(biRecord& record, const Value& value, const Options& options);
Stored store(boRecord& record, const Value& value, const Options& options);
Stored store(mbbiRecord& record, const Value& value, const Options& options);
Stored store(mbboRecord& record, const Value& value, const Options& options);
Stored store(mbbiDirectRecord& record, const Value& value, const Options& options);
Stored store(mbboDirectRecord& record, const Value& value, const Options& options);
Value load(const boRecord& record, const Options& options, Scratch& scratch);
Value load(const mbboRecord& record, const Options& options, Scratch& scratch);
Value load(const mbboDirectRecord& record, const Options& options, Scratch& scratch);
void prepare(biRecord& record, const Options& options);
void prepare(boRecord& record, const Options& options);
void prepare(mbbiRecord& record, const Options& options);
void prepare(mbboRecord& record, const Options& options);
void prepare(mbbiDirectRecord& record, const Options& options);
void prepare(mbboDirectRecord& record, const Options& options);

// ---- text
Stored store(stringinRecord& record, const Value& value, const Options& options);
Stored store(stringoutRecord& record, const Value& value, const Options& options);
Stored store(lsiRecord& record, const Value& value, const Options& options);
Stored store(lsoRecord& record, const Value& value, const Options& options);
Stored store(eventRecord& record, const Value& value, const Options& options);
Value load(const stringoutRecord& record, const Options& options, Scratch& scratch);
Value load(const lsoRecord& record, const Options& options, Scratch& scratch);

// ---- arrays
Stored store(waveformRecord& record, const Value& value, const Options& options);
Stored store(aaiRecord& record, const Value& value, const Options& options);
Stored store(aaoRecord& record, const Value& value, const Options& options);
std::optional<Value> load(const aaoRecord& record, const Options& options, Scratch& scratch);

// Record types without such fields.
template <class Record>
void prepare(Record& /*record*/, const Options& /*options*/) {}

}  // namespace mpf::fields
