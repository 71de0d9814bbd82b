// SPDX-License-Identifier: MIT
// DigitalIo: driver of a module with up to 32 digital lines, GreenSpring IP-Unidig or Systran
// DIO316I.
//
//   DigitalIo io(module, {.vector = 116, .rising = 0xff, .falling = 0xff});
//   io.trySetBits(0x3);
//   const auto subscription = io.subscribe([](const DigitalIoChange& change) { ... });
//
//   an edge ──► interrupt ─┐
//   pollEvery ─────────────┴► look: pending edges, inputs ──► changes ──► each subscriber
//
// The chip detects one direction of a line at a time. For both directions, each look sets the
// polarity from the inputs and then reads the inputs again, so a line that changes in between is
// noticed, and the polarity always fits the level.
//
// The constructor does not write the outputs: they keep their values when one program ends and
// another starts. After power-up all outputs are ones.
//
// Each look also reads a register that a reset changes, and the outputs that were written. When
// these have changed by themselves and the ID PROM is the right one, the module was reset or is
// back: outputs, output enables, threshold and edges are programmed again. While the module is
// absent, or another module is in its place, nothing is written.
//
// Threads  any number of callers at a time. A subscriber is called by the driver's thread or by the
//          thread that calls this object, one call at a time; it must not call this object.
// Crash    the outputs keep their values; the carrier masks the interrupt when it is opened again.
// Trust    values that the module returns are only compared. All ones may mean an absent module, so
//          the ID PROM is read then. Bits without a function may have any value.
// Source   digital_io_kind.h.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>

#include "drivers/digital_io/digital_io_kind.h"
#include "drivers/digital_io/digital_io_registers.h"

namespace mpf {

struct DigitalIoOptions {
  std::chrono::milliseconds pollEvery{100};  // longest time between two looks
  int vector = 0;  // interrupt vector, 1 to 255; 0: no interrupts
  std::uint32_t rising = 0;  // bits that interrupt when they go high
  std::uint32_t falling = 0;  // bits that interrupt when they go low; may overlap with rising
  InterruptThreadOptions storm{};  // limits of the interrupt thread; its pollEvery is ignored
};

enum class DigitalIoStatus : std::uint8_t {
  success,
  noSuchBits,  // some of the bits are not outputs of this model; nothing was written
  outOfRange,  // the threshold is out of range; nothing was written
  noThreshold,  // this model has no threshold
  noInterrupts,  // this model has no interrupts, or they are not used
  readBackDiffers,  // the register does not hold the written value
  gone,  // the module is absent, or another module is in its place
};
// A sentence for messages to people.
[[nodiscard]] const char* toString(DigitalIoStatus status) noexcept;
// Returns true for a fault of the module, false for success and for errors of the caller.
[[nodiscard]] constexpr bool isFault(DigitalIoStatus status) noexcept {
  return status == DigitalIoStatus::readBackDiffers || status == DigitalIoStatus::gone;
}

// A change that is reported to subscribers.
struct DigitalIoChange {
  enum class Kind : std::uint8_t {
    inputs,  // inputs have changed, or had an edge and changed back
    gone,  // the module is absent or replaced
    back,  // the module is back or was reset; it is programmed again, outputs included
    lostInterrupt,  // a poll found an edge whose interrupt did not come
    storm,  // the request line is stuck: see InterruptThread; reported once until it ends
  };
  Kind kind = Kind::inputs;
  std::uint32_t inputs = 0;  // all inputs; for `gone` their last values
  std::uint32_t changed = 0;  // inputs that have changed or had an edge
};

class DigitalIo {
 public:
  using Listener = std::function<void(const DigitalIoChange& change)>;
  // Ends when it is destroyed: the listener is not running then and does not run again. A listener
  // must not destroy a subscription.
  class Subscription;

  // Programs the module and starts the driver's thread. Outputs keep their values.
  //
  //   module    must outlive this object
  //   throws    std::invalid_argument when the module is of another kind, IndustryPackError
  //             badVector, std::system_error when the thread cannot be started
  explicit DigitalIo(IndustryPackModule& module, const DigitalIoOptions& options = {});
  // Stops the thread and disables the interrupts of the module, if it is present.
  ~DigitalIo();
  DigitalIo(const DigitalIo&) = delete;
  DigitalIo& operator=(const DigitalIo&) = delete;

  [[nodiscard]] const DigitalIoKind& kind() const noexcept { return kind_; }
  [[nodiscard]] bool usesInterrupts() const noexcept { return usesInterrupts_; }

  // Sets the outputs in `mask` to `bits` and reads them back; other outputs keep their values. A
  // line with an output enable becomes an output.
  [[nodiscard]] DigitalIoStatus tryWriteBits(std::uint32_t mask, std::uint32_t bits) noexcept;
  [[nodiscard]] DigitalIoStatus trySetBits(std::uint32_t mask) noexcept {
    return tryWriteBits(mask, mask);
  }
  [[nodiscard]] DigitalIoStatus tryClearBits(std::uint32_t mask) noexcept {
    return tryWriteBits(mask, 0);
  }
  // Sets the voltage above which an input is high.
  //   code  0 to kMaxThreshold, in steps of kThresholdStepVolts
  [[nodiscard]] DigitalIoStatus trySetThreshold(int code) noexcept;
  // Sets the edges that interrupt from now on; bits that are not inputs are ignored.
  [[nodiscard]] DigitalIoStatus trySetEdges(std::uint32_t rising, std::uint32_t falling) noexcept;

  // Reads the registers. Returns nullopt when the module is absent or replaced.
  [[nodiscard]] std::optional<std::uint32_t> tryReadInputs() noexcept;
  [[nodiscard]] std::optional<std::uint32_t> tryReadOutputs() noexcept;

  struct State {
    bool isThere = false;
    std::uint32_t inputs = 0;
  };
  // Looks at the module now. All changes are reported to the subscribers before this returns the
  // state that was last reported.
  State look();

  // Calls `listener` for each change from now on, until the subscription is destroyed. This object
  // must outlive the subscription.
  [[nodiscard]] Subscription subscribe(Listener listener);
  [[nodiscard]] InterruptThread::Counters counters() const noexcept;

 private:
  bool serve(InterruptThread::Cause cause);
  bool lookLocked();
  bool tend();
  [[nodiscard]] bool hasVanished();
  [[nodiscard]] bool isReady();
  std::uint32_t followInputs(bool& hadEdges);
  bool setUp();
  void restoreOutputs();
  void noteLateness(InterruptThread::Cause cause, bool hadEdges);
  void note(InterruptFault fault);
  void report(const DigitalIoChange& change);
  [[nodiscard]] std::uint32_t edges() const noexcept { return rising_ | falling_; }
  [[nodiscard]] std::uint32_t armed() const noexcept {
    return (rising_ & ~falling_) | (rising_ & falling_ & ~state_.inputs);
  }

  // Register values that a reset would change. These are the values that were read, not those that
  // were written, since a register may be broken.
  struct Marks {
    std::uint16_t setUp = 0;
    std::uint32_t outputs = 0, enables = 0;
    friend bool operator==(const Marks&, const Marks&) = default;
  };
  [[nodiscard]] Marks readMarks();

  const DigitalIoKind& kind_;
  IndustryPackModule& module_;
  const int vector_;
  const bool usesInterrupts_;
  mutable std::mutex mutex_;  // guards the registers and the members below
  DigitalIoRegisters registers_;
  std::uint32_t rising_ = 0, falling_ = 0, polarity_ = 0;
  std::uint32_t writtenMask_ = 0, writtenBits_ = 0;  // the outputs to restore after a reset
  int threshold_ = kThresholdAtStart;
  Marks marks_;  // as read after the last setUp() or write
  State state_;
  bool mayBeLost_ = false;  // the last poll found an edge whose interrupt may still be under way
  bool isLosing_ = false;  // lostInterrupt was reported
  struct Subscriber {
    std::uint64_t id = 0;
    Listener listener;
  };
  std::vector<Subscriber> subscribers_;
  std::uint64_t lastId_ = 0;
  std::unique_ptr<Interrupt> noInterrupt_;  // in place of that of a module without interrupts
  std::unique_ptr<InterruptThread> thread_;  // last: ends before the members that it uses
};

class DigitalIo::Subscription {
 public:
  Subscription() = default;
  Subscription(DigitalIo& io, std::uint64_t id) noexcept : io_(&io), id_(id) {}
  Subscription(Subscription&& other) noexcept
      : io_(std::exchange(other.io_, nullptr)), id_(other.id_) {}
  Subscription& operator=(Subscription&& other) noexcept;
  ~Subscription() { end(); }

 private:
  void end() noexcept;
  DigitalIo* io_ = nullptr;
  std::uint64_t id_ = 0;
};

}  // namespace mpf
