// SPDX-License-Identifier: MIT
#include "epics/every_output.h"

#include <cstring>
#include <dbStaticLib.h>
#include <longoutRecord.h>
#include <utility>

namespace mpf {

template <class Record>
EveryOutput::Fields EveryOutput::fieldsOf(dbCommon* record) noexcept {
  if constexpr (requires(Record longout) { longout.oopt + longout.pval; }) {
    if (std::strcmp(record->rdes->name, "longout") != 0) return {};
    auto& longout = *reinterpret_cast<Record*>(record);
    return {&longout.oopt, &longout.pval};
  } else {
    return {};
  }
}

EveryOutput::EveryOutput(dbCommon* record, Pass pass) noexcept
    : fields_(fieldsOf<longoutRecord>(record)), pass_(pass) {
  constexpr epicsEnum16 kEveryTime = 0;
  if (fields_.option == nullptr) return;
  option_ = std::exchange(*fields_.option, kEveryTime);
  previous_ = *fields_.previous;
}

EveryOutput::~EveryOutput() {
  if (fields_.option == nullptr) return;
  *fields_.option = option_;
  if (pass_ == Pass::completion) *fields_.previous = previous_;
}

}  // namespace mpf
