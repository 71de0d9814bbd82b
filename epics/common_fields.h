// SPDX-License-Identifier: MIT
// Functions for the fields that all records share (dbCommon).
//
// Threads  with the record locked, or before the IOC runs.
#pragma once

#include <dbCommon.h>

#include <mpf/epics/dev_mpf.h>

namespace mpf {

// Prints "<record>: <field>: <error>" and disables the record: it never processes, and AMSG is the
// beginning of the error.
void refuseLink(dbCommon* record, const char* field, const char* error);
// The same; getStatus() of the device support is nonzero then.
void refuseLink(DevMpf& device, dbCommon* record, const char* field, const char* error);

// To be called when a record begins to read or write: AMSG is empty at the end unless the record
// gets an alarm. EPICS Base keeps the text of the last alarm.
void forgetReason(dbCommon* record) noexcept;

// Whether PINI lets the record process when the IOC starts.
[[nodiscard]] bool processesAtStart(const dbCommon* record) noexcept;

}  // namespace mpf
