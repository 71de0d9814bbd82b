// SPDX-License-Identifier: MIT
#include <mpf/drivers/digital_io/digital_io.h>

#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

namespace word = digital_io_word;

// Of a line that moves all the time: the rest is for the next interrupt.
constexpr int kMaxLooks = 8;
constexpr std::uint16_t kMaxVector = 255;

class NoInterrupt final : public Interrupt {
 public:
  void enable() override {}
  void disable() noexcept override {}
};

const DigitalIoKind& kindOf(const IndustryPackModule& module) {
  const auto* const kind = findDigitalIoKind(module.idProm().manufacturer, module.idProm().model);
  if (kind == nullptr) throw std::invalid_argument(module.where() + " is no module of digital lines");
  return *kind;
}

// Bits of a register that are not after power-up what setUp() makes of them. No bits: there is nothing to set up but outputs.
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
  throw IndustryPackError(IndustryPackStatus::badVector,
                          fmt::format("module \"{}\": interrupt vector {} is not 0 to 255", module.name(), vector));
}

}  // namespace

const char* toString(DigitalIoStatus status) noexcept {
  switch (status) {
    case DigitalIoStatus::success:
      return "success";
    case DigitalIoStatus::noSuchBits:
      return "this model has no such outputs";
    case DigitalIoStatus::outOfRange:
      return "out of range: a threshold is 0 to 4095";
    case DigitalIoStatus::noThreshold:
      return "this model's inputs have no threshold to set";
    case DigitalIoStatus::noInterrupts:
      return "interrupts are not used";
    case DigitalIoStatus::readBackDiffers:
      return "the register does not hold what was written";
    case DigitalIoStatus::gone:
      return "nothing answers, or another module does";
  }
  return "unknown";
}

DigitalIo::DigitalIo(IndustryPackModule& module, const DigitalIoOptions& options)
    : kind_(kindOf(module)),
      module_(module),
      vector_(checkVector(options.vector, module)),
      usesInterrupts_(kind_.hasInterrupts && options.vector != 0),
      stormPause_(options.storm.stormPause),
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
  thread_ = std::make_unique<InterruptThread>(usesInterrupts_ ? module.interrupt(0) : *noInterrupt_, threadOptions,
                                              [this](InterruptThread::Cause cause) { return serve(cause); });
  // PAIR(dio-thread): it is complete.
  running_.store(thread_.get(), std::memory_order_release);
}

DigitalIo::~DigitalIo() {
  running_.store(nullptr, std::memory_order_relaxed);
  thread_.reset();
  if (usesInterrupts_ && state_.isThere && module_.problem().empty()) registers_.write(word::kInterruptEnable, kind_.inputs, 0);
}

// Puts the module in order; outputs that were never written stay. False: it is not there, or another one is, and nothing was written.
bool DigitalIo::setUp() {
  state_.isThere = module_.problem().empty();
  if (!state_.isThere) return false;
  restoreOutputs();  // before anything drives them
  registers_.setUp(threshold_);
  if (usesInterrupts_) {
    registers_.write(word::kInterruptEnable, kind_.inputs, 0);
    registers_.writeWord(word::kVector, static_cast<std::uint16_t>(vector_));
  }
  state_.inputs = registers_.read(word::kInput, kind_.inputs) & kind_.inputs;
  if (usesInterrupts_) {
    polarity_ = armed();
    registers_.write(word::kPolarity, kind_.inputs, polarity_);
    registers_.write(word::kPending, kind_.inputs, kind_.inputs);  // edges of the time before
    registers_.write(word::kInterruptEnable, kind_.inputs, edges());
    bool hadEdges = false;
    followInputs(hadEdges);  // what moved meanwhile
  }
  marks_ = readMarks();
  return true;
}

void DigitalIo::restoreOutputs() {
  const auto now = registers_.read(word::kOutput, writtenMask_);
  registers_.write(word::kOutput, writtenMask_, (now & ~writtenMask_) | writtenBits_);
  if (kind_.driver == DigitalIoKind::Driver::switched)
    registers_.write(word::kOutputEnable, writtenMask_, registers_.read(word::kOutputEnable, writtenMask_) | writtenMask_);
}

DigitalIo::Marks DigitalIo::readMarks() {
  const auto telling = tellingOf(kind_, usesInterrupts_);
  const auto enables = kind_.driver == DigitalIoKind::Driver::switched ? writtenMask_ : 0;
  const auto setUp = telling.bits == 0 ? 0 : registers_.readWord(telling.word) & telling.bits;
  return {.setUp = static_cast<std::uint16_t>(setUp),
          .outputs = registers_.read(word::kOutput, writtenMask_) & writtenMask_,
          .enables = registers_.read(word::kOutputEnable, enables) & enables};
}

// Before something is written: what is not as it was left may be another module.
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
  if (mask != 0 && DigitalIoRegisters::isAllOnes(readBack, mask) && !module_.problem().empty()) return DigitalIoStatus::gone;
  if (((readBack ^ after) & mask) != 0) {
    writtenMask_ &= ~mask;  // nobody knows what they are to be
    writtenBits_ &= ~mask;
    marks_ = readMarks();
    return DigitalIoStatus::readBackDiffers;
  }
  // Who writes a line means it to be an output, for ever; only now, as it drives what was written.
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
  if ((!state_.isThere || DigitalIoRegisters::isAllOnes(bits, kind_.inputs)) && !module_.problem().empty()) return std::nullopt;
  return bits & kind_.inputs;
}

std::optional<std::uint32_t> DigitalIo::tryReadOutputs() noexcept {
  const std::lock_guard lock(mutex_);
  const auto bits = registers_.read(word::kOutput, kind_.outputs);
  if ((!state_.isThere || DigitalIoRegisters::isAllOnes(bits, kind_.outputs)) && !module_.problem().empty()) return std::nullopt;
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

// Tells what is new. Returns whether the chip had asked.
bool DigitalIo::lookLocked() {
  if (!tend()) return false;
  bool hadEdges = false;
  const auto changed = followInputs(hadEdges);
  if (changed != 0) tell({DigitalIoNews::Kind::inputs, state_.inputs, changed});
  return hadEdges;
}

// Sets the module up when it is back or was reset. False: it is gone, or all that is new of it was told.
bool DigitalIo::tend() {
  if (state_.isThere && readMarks() == marks_) {
    const auto inputs = registers_.read(word::kInput, kind_.inputs);
    if (!DigitalIoRegisters::isAllOnes(inputs, kind_.inputs) || module_.problem().empty()) return true;
  }
  const auto before = state_;
  if (setUp()) {
    tell({DigitalIoNews::Kind::back, state_.inputs, state_.inputs ^ before.inputs});
  } else if (before.isThere) {
    tell({DigitalIoNews::Kind::gone, state_.inputs, 0});
  }
  return false;
}

// Clears what is pending and arms each line for its next edge, until nothing moves. Returns the bits that moved.
std::uint32_t DigitalIo::followInputs(bool& hadEdges) {
  std::uint32_t changed = 0;
  for (int look = 0; look < kMaxLooks; ++look) {
    const auto pending = usesInterrupts_ ? registers_.read(word::kPending, kind_.inputs) & edges() : 0;
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

// An edge that a poll finds may have come just now: it is lost when no interrupt follows until the next poll.
void DigitalIo::noteLateness(InterruptThread::Cause cause, bool hadEdges) {
  if (cause == InterruptThread::Cause::interrupt) {
    mayBeLost_ = false;
    if (hadEdges) isLosing_ = false;
    return;
  }
  if (std::exchange(mayBeLost_, hadEdges) && !std::exchange(isLosing_, true)) tell({DigitalIoNews::Kind::lostInterrupt, state_.inputs, 0});
  noteStorms();
}

// At each poll. A line that is stuck makes one storm after each pause: all of them are one until a time between two polls was calm.
void DigitalIo::noteStorms() {
  // PAIR(dio-thread): while it is being made there is none to ask.
  const auto* const thread = running_.load(std::memory_order_acquire);
  const auto counters = thread == nullptr ? InterruptThread::Counters() : thread->counters();
  const bool isCalm = std::exchange(spurious_, counters.spurious) == counters.spurious;
  if (std::exchange(storms_, counters.storms) != counters.storms) {
    pauseEnds_ = Deadline::after(stormPause_);
    goesOn_ = false;
    if (!std::exchange(isStorming_, true)) tell({DigitalIoNews::Kind::storm, state_.inputs, 0});
  } else if (isStorming_ && pauseEnds_.hasPassed() && std::exchange(goesOn_, true) && isCalm) {
    isStorming_ = false;
  }
}

void DigitalIo::tell(const DigitalIoNews& news) {
  for (const auto& subscriber : subscribers_) subscriber.listener(news);
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
  std::erase_if(io->subscribers_, [&](const Subscriber& subscriber) { return subscriber.id == id_; });
}

}  // namespace mpf
