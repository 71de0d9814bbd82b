// SPDX-License-Identifier: MIT
// EveryOutput: while it exists, a longout calls its device support whenever it processes, as with
// OOPT "Every Time".
//
// Record support asks OOPT also when a request has ended, and PVAL, the value for "On Change", is
// already the one that was written: without this object the record would not get the result.
//
// Threads  with the record locked: only records that it processes (FLNK) can see the changed OOPT.
// Base     longout has had OOPT since 7.0.8; with an older one, and for other records, no effect.
#pragma once

#include <dbCommon.h>
#include <epicsTypes.h>

namespace mpf {

class EveryOutput {
 public:
  enum class Pass {
    write,  // the record writes VAL
    completion  // the record gets the result of a write; PVAL stays the value that was written
  };
  EveryOutput(dbCommon* record, Pass pass) noexcept;
  ~EveryOutput();
  EveryOutput(const EveryOutput&) = delete;
  EveryOutput& operator=(const EveryOutput&) = delete;

 private:
  struct Fields {
    epicsEnum16* option = nullptr;  // OOPT; null: the record has none
    epicsInt32* previous = nullptr;  // PVAL
  };
  template <class Record>
  static Fields fieldsOf(dbCommon* record) noexcept;

  const Fields fields_;
  const Pass pass_;
  epicsEnum16 option_ = 0;
  epicsInt32 previous_ = 0;
};

}  // namespace mpf
