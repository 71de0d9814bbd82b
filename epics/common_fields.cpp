// SPDX-License-Identifier: MIT
#include "epics/common_fields.h"

#include <alarm.h>
#include <dbAccess.h>
#include <errlog.h>
#include <menuPini.h>
#include <recGbl.h>

namespace mpf {

void refuseLink(dbCommon* record, const char* field, const char* error) {
  errlogPrintf("%s: %s: %s\n", record->name, field, error);
  recGblSetSevrMsg(record, LINK_ALARM, INVALID_ALARM, "%s", error);
  recGblResetAlarms(record);
  record->pact = TRUE;
}

void refuseLink(DevMpf& device, dbCommon* record, const char* field, const char* error) {
  refuseLink(record, field, error);
  device.setStatus(S_db_badField);
}

void forgetReason(dbCommon* record) noexcept {
  if (record->nsev == NO_ALARM) record->namsg[0] = '\0';
}

bool processesAtStart(const dbCommon* record) noexcept {
  return record->pini == menuPiniYES || record->pini == menuPiniRUN ||
         record->pini == menuPiniRUNNING;
}

}  // namespace mpf
