// SPDX-License-Identifier: MIT
// Ti9914Chip: the registers of a TI9914, their timing, and its events, which it collects from
// interrupts and by polling.
//
//   ISR0, ISR1 ──┬─ the caller polls, for a short time ─┐
//                └─ interrupt thread, while it sleeps ──┴──► poll(), waitFor()
//
//        ┌──────── setUp() ────────┐
//        │                         ▼
//      lost                     in charge
//        ▲                         │
//        └─ module does not answer ┘
//
// Threads  one thread calls; an interrupt thread of its own collects events beside it.
// Crash    the carrier masks the interrupt when it is opened again; the next program sets up the
//          chip.
// Trust    a module that was pulled out reads as ones: it is recognised by its ID PROM.
// Source   TMS9914A data manual; drvGsIP488 of asyn for the spacing of commands.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>

#include "base/inheriting_mutex.h"
#include "drivers/ti9914/ti9914.h"

namespace mpf {

class Ti9914Chip {
 public:
  // Bits of poll(): those of ISR0, and those of ISR1 in the high byte.
  enum Event : std::uint32_t {
    kEnd = ti9914::kEnd,
    kCanSend = ti9914::kBo,
    kHasByte = ti9914::kBi,
    kServiceRequest = ti9914::kSrq << 8,
    kNoAcceptor = ti9914::kErr << 8,
    kLost = 1 << 16,  // the module does not answer
  };
  struct Options {
    int vector = 0;
    // How long a caller polls before it sleeps until an interrupt.
    std::chrono::microseconds spin{50};
    // How often the chip is polled while a caller sleeps, and while none does.
    std::chrono::milliseconds pollEvery{5};
    std::chrono::milliseconds idlePollEvery{100};
    // Called once each time a fault of the interrupt line begins, with a sentence for people; on
    // the thread of this object.
    std::function<void(const std::string& what)> onAlarm{};
  };

  // Sets up the chip.
  //   module            outlives this object
  //   onServiceRequest  called soon after the SRQ line has become active, on the thread of this
  //                     object; it may call forget() only
  //   throws            IndustryPackError badVector; std::system_error when the thread or its
  //                     descriptor cannot be created
  Ti9914Chip(IndustryPackModule& module, const Options& options,
             std::function<void()> onServiceRequest);
  // Releases the bus.
  ~Ti9914Chip();
  Ti9914Chip(const Ti9914Chip&) = delete;
  Ti9914Chip& operator=(const Ti9914Chip&) = delete;

  // Resets the chip, sends IFC and takes charge of the bus: the chip drives ATN afterwards. Of the
  // states only kSre lasts; it is set at the start.
  //   returns  empty; or a sentence that says why the module cannot be used
  [[nodiscard]] std::string setUp();
  // Whether setUp() is necessary.
  [[nodiscard]] bool isLost() const;

  // A command to AUXCR, in due distance from the former one.
  void command(ti9914::Aux command, bool set = false);
  // A state of AUXCR; written only when it changes.
  void setState(ti9914::Aux state, bool on);

  // Sends IFC.
  void pulseInterfaceClear();
  void noteActiveServiceRequest();
  void write(std::uint8_t byte);  // CDOR
  [[nodiscard]] std::uint8_t read();  // DIR
  // The active lines of the bus, of gpib_line.
  [[nodiscard]] std::uint8_t lines() { return io_.read8(ti9914::kBsr); }

  // Polls for one of the events `wanted` for a short time. The events remain.
  //   returns  the events that have occurred
  [[nodiscard]] std::uint32_t poll(std::uint32_t wanted);
  // The same, and sleeps when that is not enough; until the deadline, or until kLost.
  [[nodiscard]] std::uint32_t waitFor(std::uint32_t wanted, Deadline deadline);
  void forget(std::uint32_t events);

 private:
  bool serve(InterruptThread::Cause cause);
  bool collect(bool all);
  void collectForCaller();
  void sleep(std::uint32_t wanted, Deadline deadline);
  void enableEvents(bool on);
  void report(InterruptFault fault) const;

  IndustryPackModule& module_;
  Registers& io_;
  const Options options_;
  const std::function<void()> onServiceRequest_;

  // used by the calling thread only
  std::int64_t commandAtNs_ = 0;
  std::uint32_t statesOn_ = 1U << ti9914::kSre;  // a bit for each ti9914::Aux

  mutable InheritingMutex mutex_;  // guards the members below, and reads of ISR0 and ISR1
  std::condition_variable_any changed_;
  std::uint32_t events_ = kLost;
  std::uint8_t imr0_ = 0;
  std::uint8_t imr1_ = 0;
  bool mayInterrupt_ = false;  // an interrupt may come whose event was collected before

  InterruptThread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
