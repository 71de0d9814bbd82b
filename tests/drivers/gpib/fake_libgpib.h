// SPDX-License-Identifier: MIT
// fake_libgpib: a shared object with the functions of libgpib for one board, whose bus is a model.
// A test controls it with the functions below, which it finds with dlsym().
//
// Threads  one at a time.
#pragma once

#include "drivers/gpib/instrument_model.h"

extern "C" {
// Removes all instruments and faults.
void fakeGpibReset();
//   secondary  -1: none
void fakeGpibAttach(int primary, int secondary, mpf::GpibInstrumentModel* instrument);
// The next `calls` calls of this function fail.
//   error  a number of iberr
//   count  the value of ibcntl
void fakeGpibFail(const char* function, int error, int count, int calls);
// Whether the board can see its lines.
void fakeGpibMonitorLines(bool on);
// The calls of ibsic.
int fakeGpibInterfaceClears();
}
