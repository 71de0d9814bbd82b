// SPDX-License-Identifier: MIT
// DigitalIo: a module of digital lines, GreenSpring IP-Unidig or Systran DIO316I, in up to 32 bits.
//
//   DigitalIo io(module, {.vector = 116, .rising = 0xff, .falling = 0xff});
//   io.trySetBits(0x3);
//   const auto subscription = io.subscribe([](const DigitalIoNews& news) { ... });
//
//   an edge ──► interrupt ─┐
//   pollEvery ─────────────┴► look: pending edges, inputs ──► what is new ──► each subscriber
//
// The chip tells of one direction of a line at a time. For both, the polarity is set anew at each look, from the inputs, and the inputs are
// read again afterwards: a line that moves in between is seen, and no toggling gets out of step.
//
// Outputs are not written at start: they stay as they were while a program ends and another begins. After power-up all are ones.
//
// Each look also asks a register that power-up changes, and the outputs that were written. When they are not as they were left, and the
// ID PROM is the right one, the module was reset or is back: outputs, enables, threshold and edges become what they were set to. While it
// is gone, or another module is in its place, nothing is written.
//
// Threads  any. Subscribers are called from the driver's thread or the one that looks, one at a time, and must not call this object.
// Crash    outputs stay; the carrier masks the interrupt when it is opened again.
// Trust    what the module says is compared, nothing else. All ones may be a module that is gone: then its ID PROM is asked. Registers may
//          have anything in bits without a function.
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

#include <mpf/base/clock.h>
#include <mpf/drivers/digital_io/digital_io_kind.h>
#include <mpf/drivers/digital_io/digital_io_registers.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

struct DigitalIoOptions {
  std::chrono::milliseconds pollEvery{100};
  int vector = 0;  // 0: no interrupts
  std::uint32_t rising = 0;  // bits that interrupt when they go high
  std::uint32_t falling = 0;  // when they go low; in both: either way
  InterruptThreadOptions storm{};  // its pollEvery does not count
};

enum class DigitalIoStatus : std::uint8_t {
  success,
  noSuchBits,  // this model cannot write them; nothing was written
  outOfRange,  // of the threshold; nothing was written
  noThreshold,  // this model has none
  noInterrupts,  // this model has none, or they are not used
  readBackDiffers,  // the register holds something else than was written
  gone,  // nothing answers, or another module does
};
[[nodiscard]] const char* toString(DigitalIoStatus status) noexcept;
// Whether that is the module's fault, not the caller's.
[[nodiscard]] constexpr bool isFault(DigitalIoStatus status) noexcept {
  return status == DigitalIoStatus::readBackDiffers || status == DigitalIoStatus::gone;
}

// What a subscriber hears.
struct DigitalIoNews {
  enum class Kind : std::uint8_t {
    inputs,  // they have changed, or an edge came and went
    gone,  // nothing answers any more
    back,  // it answers again, or was reset: it is set up anew, with what was written to its outputs
    lostInterrupt,  // an edge was found by the poll: the interrupt did not come
    storm,  // the line is stuck: interrupts are masked for a while, again and again; told when that begins
  };
  Kind kind = Kind::inputs;
  std::uint32_t inputs = 0;  // as they are; of `gone`: as they were
  std::uint32_t changed = 0;  // bits that are different or had an edge
};

class DigitalIo {
 public:
  using Listener = std::function<void(const DigitalIoNews& news)>;
  // Ends when it is destroyed: the listener does not run any more. Not from within a listener.
  class Subscription;

  // Sets the module up; `module` must outlive this.
  //   throws  std::system_error; std::invalid_argument when it is no such module; IndustryPackError badVector
  explicit DigitalIo(IndustryPackModule& module, const DigitalIoOptions& options = {});
  // The module, if it is still there, interrupts no more.
  ~DigitalIo();
  DigitalIo(const DigitalIo&) = delete;
  DigitalIo& operator=(const DigitalIo&) = delete;

  [[nodiscard]] const DigitalIoKind& kind() const noexcept { return kind_; }
  [[nodiscard]] bool usesInterrupts() const noexcept { return usesInterrupts_; }

  // The bits of `mask` become those of `bits`; others stay.
  [[nodiscard]] DigitalIoStatus tryWriteBits(std::uint32_t mask, std::uint32_t bits) noexcept;
  [[nodiscard]] DigitalIoStatus trySetBits(std::uint32_t mask) noexcept { return tryWriteBits(mask, mask); }
  [[nodiscard]] DigitalIoStatus tryClearBits(std::uint32_t mask) noexcept { return tryWriteBits(mask, 0); }
  // From which voltage on an input is high, in steps of kThresholdStepVolts.
  [[nodiscard]] DigitalIoStatus trySetThreshold(int code) noexcept;
  // Which edges interrupt from now on; bits that are no inputs are ignored.
  [[nodiscard]] DigitalIoStatus trySetEdges(std::uint32_t rising, std::uint32_t falling) noexcept;

  // From the registers, now. Empty: it is gone.
  [[nodiscard]] std::optional<std::uint32_t> tryReadInputs() noexcept;
  [[nodiscard]] std::optional<std::uint32_t> tryReadOutputs() noexcept;

  struct State {
    bool isThere = false;
    std::uint32_t inputs = 0;
  };
  // Looks at once, so that subscribers know all that is new, and says what they know.
  State look();

  [[nodiscard]] Subscription subscribe(Listener listener);
  [[nodiscard]] InterruptThread::Counters counters() const noexcept;

 private:
  bool serve(InterruptThread::Cause cause);
  bool lookLocked();
  bool tend();
  [[nodiscard]] bool isReady();
  std::uint32_t followInputs(bool& hadEdges);
  bool setUp();
  void restoreOutputs();
  void noteLateness(InterruptThread::Cause cause, bool hadEdges);
  void noteStorms();
  void tell(const DigitalIoNews& news);
  [[nodiscard]] std::uint32_t edges() const noexcept { return rising_ | falling_; }
  [[nodiscard]] std::uint32_t armed() const noexcept { return (rising_ & ~falling_) | (rising_ & falling_ & ~state_.inputs); }

  // What a reset would change, as it is read; not as it was written, for a register may be broken.
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
  const std::chrono::milliseconds stormPause_;
  mutable std::mutex mutex_;  // guards the registers and what follows
  DigitalIoRegisters registers_;
  std::uint32_t rising_ = 0, falling_ = 0, polarity_ = 0;
  std::uint32_t writtenMask_ = 0, writtenBits_ = 0;  // of outputs, as long as they are to be kept
  int threshold_ = kThresholdAtStart;
  Marks marks_;  // when it was set up or written to
  State state_;
  bool mayBeLost_ = false;  // the last poll found an edge whose interrupt may still be on its way
  bool isLosing_ = false;  // told so
  bool isStorming_ = false;  // told so
  bool goesOn_ = false;  // the last poll came after the pause
  Deadline pauseEnds_ = Deadline::never();
  std::uint64_t storms_ = 0, spurious_ = 0;  // as counted at the last poll
  struct Subscriber {
    std::uint64_t id = 0;
    Listener listener;
  };
  std::vector<Subscriber> subscribers_;
  std::uint64_t lastId_ = 0;
  std::unique_ptr<Interrupt> noInterrupt_;  // where the module has none
  std::atomic<InterruptThread*> running_{nullptr};
  std::unique_ptr<InterruptThread> thread_;  // last: ends before what it uses
};

class DigitalIo::Subscription {
 public:
  Subscription() = default;
  Subscription(DigitalIo& io, std::uint64_t id) noexcept : io_(&io), id_(id) {}
  Subscription(Subscription&& other) noexcept : io_(std::exchange(other.io_, nullptr)), id_(other.id_) {}
  Subscription& operator=(Subscription&& other) noexcept;
  ~Subscription() { end(); }

 private:
  void end() noexcept;
  DigitalIo* io_ = nullptr;
  std::uint64_t id_ = 0;
};

}  // namespace mpf
