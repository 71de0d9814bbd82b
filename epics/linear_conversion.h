// SPDX-License-Identifier: MIT
// The linear conversion (LINR "LINEAR") of ai and ao records.
//
// Threads  with the record locked, or before the IOC runs.
#pragma once

namespace mpf {

// Sets ESLO and EOFF so that the codes `low` to `high` in RVAL correspond to EGUL to EGUF.
template <class Record>
void setLinearConversion(Record& record, double low, double high) noexcept {
  record.eslo = (record.eguf - record.egul) / (high - low);
  record.eoff = record.egul - low * record.eslo;
}

}  // namespace mpf
