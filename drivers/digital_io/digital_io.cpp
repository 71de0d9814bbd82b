// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io.h"

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

namespace word = digital_io_word;

// Limits the work for a line that changes all the time; the next interrupt continues.
constexpr int kMaxLooks = 8;
constexpr std::uint16_t kMaxVector = 255;

class NoInterrupt final : public Interrupt {
 public:
  void enable() override {}
  void disable() noexcept override {}
};

const DigitalIoKind& kindOf(const IndustryPackModule& module) {
  const auto* const kind = findDigitalIoKind(module.idProm().manufacturer, module.idProm().model);
  if (kind == nullptr)
    throw std::invalid_argument(module.where() + " is not a supported module of digital lines");
  return *kind;
}

// Bits of a register whose value after setUp() differs from that after power-up; they show a reset.
// No bits: setUp() writes nothing but outputs.
struct Telling {
  std::size_t word = 0;
  std::uint16_t bits = 0;
};
Telling tellingOf(const DigitalIoKind& kind, bool usesInterrupts) {
  if (usesInterrupts) return {word::kVector, kMaxVector};
  if (kind.isSystran()) return {word::kSystranEnable, word::kSystranPorts};
  if (kind.controlBits != 0) return {word::kControl, kind.controlBits};
  return kind.hasThreshold ? Telling{word::kThreshold, kMaxThreshold} : Telling();
}

int checkVector(int vector, const IndustryPackModule& module) {
  if (vector >= 0 && vector <= kMaxVector) return vector;
  throw IndustryPackError(
      IndustryPackStatus::badVector,
      fmt::format("module \"{}\": interrupt vector {} is not 0 to 255", module.name(), vector));
}

}  // namespace

const char* toString(DigitalIoStatus status) noexcept {
  switch (status) {
    case DigitalIoStatus::success:
      return "success";
    case DigitalIoStatus::noSuchBits:
      return "this model has no outputs at some of these bits";
    case DigitalIoStatus::outOfRange:
      return "out of range: a threshold is 0 to 4095";
    case DigitalIoStatus::noThreshold:
      return "the inputs of this model have no threshold";
    case DigitalIoStatus::noInterrupts:
      return "interrupts are not used";
    case DigitalIoStatus::readBackDiffers:
      return "the register does not hold what was written";
    case DigitalIoStatus::gone:
      return "the module is absent, or another module is in its place";
  }
  return "unknown";
}

DigitalIo::DigitalIo(IndustryPackModule& module, const DigitalIoOptions& options)
    : kind_(kindOf(module)),
      module_(module),
      vector_(checkVector(options.vector, module)),
      usesInterrupts_(kind_.hasInterrupts && options.vector != 0),
      registers_(module.io(), kind_),
      rising_(options.rising & kind_.inputs),
      falling_(options.falling & kind_.inputs) {
  static_cast<void>(setUp());
  if (!usesInterrupts_) {
    noInterrupt_ = std::make_unique<NoInterrupt>();
    noInterrupt_->setPriority(module.interrupt(0).priority());
  }
  auto threadOptions = options.storm;
  threadOptions.pollEvery = options.pollEvery;
  thread_ = std::make_unique<InterruptThread>(
      usesInterrupts_ ? module.interrupt(0) : *noInterrupt_, threadOptions,
      [this](InterruptThread::Cause cause) { return serve(cause); },
      [this](InterruptFault fault) { note(fault); });
}

DigitalIo::~DigitalIo() {
  thread_.reset();
  if (usesInterrupts_ && state_.isThere && module_.problem().empty())
    registers_.write(word::kInterruptEnable, kind_.inputs, 0);
}

// Programs the module; outputs that were never written keep their values. Returns false, and writes
// nothing, when the module is absent or replaced.
bool DigitalIo::setUp() {
  state_.isThere = module_.problem().empty();
  if (!state_.isThere) return false;
  restoreOutputs();  // before the drivers are switched on
  registers_.setUp(threshold_);
  if (usesInterrupts_) {
    registers_.write(word::kInterruptEnable, kind_.inputs, 0);
    registers_.writeWord(word::kVector, static_cast<std::uint16_t>(vector_));
  }
  state_.inputs = registers_.read(word::kInput, kind_.inputs) & kind_.inputs;
  if (usesInterrupts_) {
    polarity_ = armed();
    registers_.write(word::kPolarity, kind_.inputs, polarity_);
    registers_.write(word::kPending, kind_.inputs, kind_.inputs);  // clears edges from before
    registers_.write(word::kInterruptEnable, kind_.inputs, edges());
    bool hadEdges = false;
    followInputs(hadEdges);  // finds inputs that have changed meanwhile
  }
  marks_ = readMarks();
  return true;
}

void DigitalIo::restoreOutputs() {
  const auto now = registers_.read(word::kOutput, writtenMask_);
  registers_.write(word::kOutput, writtenMask_, (now & ~writtenMask_) | writtenBits_);
  if (kind_.driver == DigitalIoKind::Driver::switched)
    registers_.write(word::kOutputEnable, writtenMask_,
                     registers_.read(word::kOutputEnable, writtenMask_) | writtenMask_);
}

DigitalIo::Marks DigitalIo::readMarks() {
  const auto telling = tellingOf(kind_, usesInterrupts_);
  const auto enables = kind_.driver == DigitalIoKind::Driver::switched ? writtenMask_ : 0;
  const auto setUp = telling.bits == 0 ? 0 : registers_.readWord(telling.word) & telling.bits;
  return {.setUp = static_cast<std::uint16_t>(setUp),
          .outputs = registers_.read(word::kOutput, writtenMask_) & writtenMask_,
          .enables = registers_.read(word::kOutputEnable, enables) & enables};
}

// Called before a write: a register that has changed by itself may be that of another module.
bool DigitalIo::isReady() {
  if (!state_.isThere || readMarks() != marks_) tend();
  return state_.isThere;
}

DigitalIoStatus DigitalIo::tryWriteBits(std::uint32_t mask, std::uint32_t bits) noexcept {
  if ((mask & ~kind_.outputs) != 0) return DigitalIoStatus::noSuchBits;
  const std::lock_guard lock(mutex_);
  if (!isReady()) return DigitalIoStatus::gone;
  const auto before = registers_.read(word::kOutput, mask);
  const auto after = (before & ~mask) | (bits & mask);
  registers_.write(word::kOutput, mask, after);
  const auto readBack = registers_.read(word::kOutput, mask);
  if (mask != 0 && DigitalIoRegisters::isAllOnes(readBack, mask) && !module_.problem().empty())
    return DigitalIoStatus::gone;
  if (((readBack ^ after) & mask) != 0) {
    writtenMask_ &= ~mask;  // their values are unknown now, so they are not restored
    writtenBits_ &= ~mask;
    marks_ = readMarks();
    return DigitalIoStatus::readBackDiffers;
  }
  // A line that was written is an output from now on. It is switched on last, when it drives the
  // right value.
  if (kind_.driver == DigitalIoKind::Driver::switched)
    registers_.write(word::kOutputEnable, mask, registers_.read(word::kOutputEnable, mask) | mask);
  writtenMask_ |= mask;
  writtenBits_ = (writtenBits_ & ~mask) | (after & mask);
  marks_ = readMarks();
  return DigitalIoStatus::success;
}

DigitalIoStatus DigitalIo::trySetThreshold(int code) noexcept {
  if (!kind_.hasThreshold) return DigitalIoStatus::noThreshold;
  if (code < 0 || code > kMaxThreshold) return DigitalIoStatus::outOfRange;
  const std::lock_guard lock(mutex_);
  if (!isReady()) return DigitalIoStatus::gone;
  registers_.writeWord(word::kThreshold, static_cast<std::uint16_t>(code));
  if (!module_.problem().empty()) return DigitalIoStatus::gone;
  threshold_ = code;
  marks_ = readMarks();
  return DigitalIoStatus::success;
}

DigitalIoStatus DigitalIo::trySetEdges(std::uint32_t rising, std::uint32_t falling) noexcept {
  if (!usesInterrupts_) return DigitalIoStatus::noInterrupts;
  const std::lock_guard lock(mutex_);
  if (!isReady()) return DigitalIoStatus::gone;
  rising_ = rising & kind_.inputs;
  falling_ = falling & kind_.inputs;
  registers_.write(word::kInterruptEnable, kind_.inputs, edges());
  if ((registers_.read(word::kInterruptEnable, kind_.inputs) & kind_.inputs) != edges())
    return module_.problem().empty() ? DigitalIoStatus::readBackDiffers : DigitalIoStatus::gone;
  lookLocked();
  return DigitalIoStatus::success;
}

std::optional<std::uint32_t> DigitalIo::tryReadInputs() noexcept {
  const std::lock_guard lock(mutex_);
  const auto bits = registers_.read(word::kInput, kind_.inputs);
  if ((!state_.isThere || DigitalIoRegisters::isAllOnes(bits, kind_.inputs)) &&
      !module_.problem().empty())
    return std::nullopt;
  return bits & kind_.inputs;
}

std::optional<std::uint32_t> DigitalIo::tryReadOutputs() noexcept {
  const std::lock_guard lock(mutex_);
  const auto bits = registers_.read(word::kOutput, kind_.outputs);
  if ((!state_.isThere || DigitalIoRegisters::isAllOnes(bits, kind_.outputs)) &&
      !module_.problem().empty())
    return std::nullopt;
  return bits & kind_.outputs;
}

DigitalIo::State DigitalIo::look() {
  const std::lock_guard lock(mutex_);
  lookLocked();
  return state_;
}

InterruptThread::Counters DigitalIo::counters() const noexcept { return thread_->counters(); }

bool DigitalIo::serve(InterruptThread::Cause cause) {
  const std::lock_guard lock(mutex_);
  const bool hadEdges = lookLocked();
  if (usesInterrupts_) noteLateness(cause, hadEdges);
  return hadEdges;
}

// Reports all changes to the subscribers. Returns whether the chip had pending edges.
bool DigitalIo::lookLocked() {
  if (!tend()) return false;
  const auto inputs = state_.inputs;
  bool hadEdges = false;
  const auto changed = followInputs(hadEdges);
  if (changed != 0 && hasVanished()) {  // while it was read: the values are not those of its inputs
    state_.inputs = inputs;
    tend();
    return false;
  }
  if (changed != 0) report({DigitalIoChange::Kind::inputs, state_.inputs, changed});
  return hadEdges;
}

// Whether the module is gone or was reset. An absent module reads as all ones.
bool DigitalIo::hasVanished() {
  if (readMarks() != marks_) return true;
  const auto inputs = registers_.read(word::kInput, kind_.inputs);
  return DigitalIoRegisters::isAllOnes(inputs, kind_.inputs) && !module_.problem().empty();
}

// Programs the module when it is back or was reset. Returns false when it is gone, or when all
// changes have been reported already.
bool DigitalIo::tend() {
  if (state_.isThere && !hasVanished()) return true;
  const auto before = state_;
  if (setUp()) {
    report({DigitalIoChange::Kind::back, state_.inputs, state_.inputs ^ before.inputs});
  } else if (before.isThere) {
    report({DigitalIoChange::Kind::gone, state_.inputs, 0});
  }
  return false;
}

// Clears pending edges and arms each line for its next edge, until no input changes. Returns the
// bits that have changed.
std::uint32_t DigitalIo::followInputs(bool& hadEdges) {
  std::uint32_t changed = 0;
  for (int look = 0; look < kMaxLooks; ++look) {
    const auto pending =
        usesInterrupts_ ? registers_.read(word::kPending, kind_.inputs) & edges() : 0;
    if (pending != 0) registers_.write(word::kPending, kind_.inputs, pending);
    const auto inputs = registers_.read(word::kInput, kind_.inputs) & kind_.inputs;
    changed |= pending | (inputs ^ state_.inputs);
    hadEdges = hadEdges || pending != 0;
    state_.inputs = inputs;
    const auto polarity = armed();
    if (!usesInterrupts_ || std::exchange(polarity_, polarity) == polarity) break;
    registers_.write(word::kPolarity, kind_.inputs, polarity);
  }
  return changed;
}

// An edge that a poll finds may be so recent that its interrupt is under way; the interrupt is lost
// if it has not come by the next poll.
void DigitalIo::noteLateness(InterruptThread::Cause cause, bool hadEdges) {
  if (cause == InterruptThread::Cause::interrupt) {
    mayBeLost_ = false;
    if (hadEdges) isLosing_ = false;
    return;
  }
  if (std::exchange(mayBeLost_, hadEdges) && !std::exchange(isLosing_, true))
    report({DigitalIoChange::Kind::lostInterrupt, state_.inputs, 0});
}

// Lost interrupts are found by noteLateness(), which compares edges, and a carrier that polls
// reports that itself.
void DigitalIo::note(InterruptFault fault) {
  if (fault != InterruptFault::storm) return;
  const std::lock_guard lock(mutex_);
  report({DigitalIoChange::Kind::storm, state_.inputs, 0});
}

void DigitalIo::report(const DigitalIoChange& change) {
  for (const auto& subscriber : subscribers_) subscriber.listener(change);
}

DigitalIo::Subscription DigitalIo::subscribe(Listener listener) {
  const std::lock_guard lock(mutex_);
  subscribers_.push_back({++lastId_, std::move(listener)});
  return {*this, lastId_};
}

DigitalIo::Subscription& DigitalIo::Subscription::operator=(Subscription&& other) noexcept {
  end();
  io_ = std::exchange(other.io_, nullptr);
  id_ = other.id_;
  return *this;
}

void DigitalIo::Subscription::end() noexcept {
  auto* const io = std::exchange(io_, nullptr);
  if (io == nullptr) return;
  const std::lock_guard lock(io->mutex_);
  std::erase_if(io->subscribers_,
                [&](const Subscriber& subscriber) { return subscriber.id == id_; });
}

}  // namespace mpf
