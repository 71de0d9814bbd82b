// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_chip.h"

#include <algorithm>
#include <fmt/format.h>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/gpib/bus_lines.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data manual
using namespace ti9914;

constexpr std::uint8_t kOnes = 0xff;  // read where nothing answers
constexpr std::uint8_t kEvents0 = kBo | kBi | ti9914::kEnd;
// Some clock cycles of the chip.
constexpr std::int64_t kResetNs = 20'000;
// IEEE 488.1: at least 100 us.
constexpr std::chrono::microseconds kInterfaceClear{120};

void spinUntil(std::int64_t ns) noexcept {
  while (Clock::nowNs() < ns) {
  }
}

}  // namespace

Ti9914Chip::Ti9914Chip(IndustryPackModule& module, const Options& options,
                       std::function<void()> onServiceRequest)
    : module_(module),
      io_(module.io()),
      options_{options},
      onServiceRequest_(std::move(onServiceRequest)),
      thread_(
          module.interrupt(0), {.pollEvery = options.idlePollEvery},
          [this](InterruptThread::Cause cause) { return serve(cause); },
          [this](InterruptFault fault) { report(fault); }) {
  static_cast<void>(module_.checkedVector(options_.vector));
}

Ti9914Chip::~Ti9914Chip() {
  if (!isLost() && module_.problem().empty()) setState(kSwrst, true);
}

std::string Ti9914Chip::setUp() {
  if (auto problem = module_.problem(); !problem.empty()) {
    const std::lock_guard lock(mutex_);
    events_ |= kLost;
    return problem;
  }
  const bool isRemoteEnabled = (statesOn_ & (1U << kSre)) != 0;
  command(kSwrst, true);
  spinUntil(Clock::nowNs() + kResetNs);
  io_.write8(kAdr, 0);
  io_.write8(kVector, static_cast<std::uint8_t>(options_.vector | kVectorEnabled));
  command(kSwrst, false);
  // A reset need not end them.
  for (const auto state : {kHdfa, kHdfe, kLon, kTon, kDai}) command(state, false);
  statesOn_ = 0;
  {
    const std::lock_guard lock(mutex_);
    static_cast<void>(io_.read8(kIsr0));
    static_cast<void>(io_.read8(kIsr1));
    events_ = 0;
    enableEvents(false);
  }
  pulseInterfaceClear();
  setState(kSre, isRemoteEnabled);
  noteActiveServiceRequest();
  return {};
}

// The reset has dropped the event of a line that is active already.
void Ti9914Chip::noteActiveServiceRequest() {
  if ((lines() & gpib_line::kSrq) == 0) return;
  const std::lock_guard lock(mutex_);
  events_ |= kServiceRequest;
  thread_.wake();
}

bool Ti9914Chip::isLost() const {
  const std::lock_guard lock(mutex_);
  return (events_ & kLost) != 0;
}

// ---- registers

void Ti9914Chip::command(Aux command, bool set) {
  spinUntil(commandAtNs_ + kAuxSpacingNs);
  io_.write8(kAuxcr, static_cast<std::uint8_t>(command | (set ? kSet : 0)));
  commandAtNs_ = Clock::nowNs();
}

void Ti9914Chip::setState(Aux state, bool on) {
  const auto bit = std::uint32_t{1} << state;
  if (((statesOn_ & bit) != 0) == on) return;
  command(state, on);
  statesOn_ ^= bit;
}

void Ti9914Chip::pulseInterfaceClear() {
  setState(kSic, true);
  std::this_thread::sleep_for(kInterfaceClear);
  setState(kSic, false);
}

void Ti9914Chip::write(std::uint8_t byte) {
  const std::lock_guard lock(mutex_);
  events_ &= ~std::uint32_t{kCanSend | kNoAcceptor};
  io_.write8(kCdor, byte);
}

std::uint8_t Ti9914Chip::read() {
  const std::lock_guard lock(mutex_);
  events_ &= ~std::uint32_t{kHasByte | kEnd};
  return io_.read8(kDir);
}

// ---- events

std::uint32_t Ti9914Chip::poll(std::uint32_t wanted) {
  const auto until = Clock::nowNs() + Nanoseconds(options_.spin).count();
  for (;;) {
    const std::lock_guard lock(mutex_);
    if ((events_ & (wanted | kLost)) == 0) collectForCaller();
    if ((events_ & (wanted | kLost)) != 0 || Clock::nowNs() >= until) return events_;
  }
}

std::uint32_t Ti9914Chip::waitFor(std::uint32_t wanted, Deadline deadline) {
  for (;;) {
    const auto events = poll(wanted);
    if ((events & (wanted | kLost)) != 0 || deadline.hasPassed()) return events;
    sleep(wanted, deadline);
  }
}

void Ti9914Chip::forget(std::uint32_t events) {
  const std::lock_guard lock(mutex_);
  collectForCaller();
  events_ &= ~(events & ~std::uint32_t{kLost});
}

void Ti9914Chip::sleep(std::uint32_t wanted, Deadline deadline) {
  std::unique_lock lock(mutex_);
  enableEvents(true);
  const auto until = std::min(deadline, Deadline::after(options_.pollEvery));
  changed_.wait_for(lock, until.left(), [&] { return (events_ & (wanted | kLost)) != 0; });
  enableEvents(false);
}

// Enables the interrupts for the events of a transfer; SRQ causes one always.
void Ti9914Chip::enableEvents(bool on) {
  imr0_ = on ? kEvents0 : 0;
  imr1_ = on ? ti9914::kSrq | kErr : ti9914::kSrq;
  io_.write8(kImr0, imr0_);
  io_.write8(kImr1, imr1_);
}

// Adds the events of the chip, which forgets them. Returns whether one of them causes interrupts.
//   all  whether to read ISR1, too, when ISR0 has an event
bool Ti9914Chip::collect(bool all) {
  if ((events_ & kLost) != 0) return false;
  const auto isr0 = io_.read8(kIsr0);
  const bool isEnough = !all && isr0 != kOnes && (isr0 & kEvents0) != 0;
  const auto isr1 = isEnough ? std::uint8_t{0} : io_.read8(kIsr1);
  if (isr0 == kOnes && isr1 == kOnes && !module_.problem().empty()) {
    events_ |= kLost;
    return false;
  }
  events_ |= (isr0 & kEvents0) | (std::uint32_t{isr1} << 8 & (kServiceRequest | kNoAcceptor));
  return (isr0 & imr0_) != 0 || (isr1 & imr1_) != 0;
}

// The caller may take an event whose interrupt is on its way, and only the thread may call the
// handler of service requests.
void Ti9914Chip::collectForCaller() {
  const bool hadServiceRequest = (events_ & kServiceRequest) != 0;
  if (collect(false)) mayInterrupt_ = true;
  if (!hadServiceRequest && (events_ & kServiceRequest) != 0) thread_.wake();
}

bool Ti9914Chip::serve(InterruptThread::Cause cause) {
  bool hadRequest = false;
  bool isServiceRequested = false;
  {
    const std::lock_guard lock(mutex_);
    hadRequest = collect(true);
    if (cause == InterruptThread::Cause::interrupt)
      hadRequest |= std::exchange(mayInterrupt_, false);
    isServiceRequested = (events_ & kServiceRequest) != 0;
    events_ &= ~std::uint32_t{kServiceRequest};
    changed_.notify_all();
  }
  if (isServiceRequested) onServiceRequest_();
  return hadRequest;
}

void Ti9914Chip::report(InterruptFault fault) const {
  if (!options_.onAlarm) return;
  const auto line =
      fmt::format("module \"{}\" ({}): the interrupt line ", module_.name(), module_.where());
  switch (fault) {
    case InterruptFault::storm:
      return options_.onAlarm(line +
                              "is stuck active without a request of the chip: it is masked for a "
                              "second at a time until it is released");
    case InterruptFault::polled:
      return options_.onAlarm(line + "is polled by its carrier from now on: transfers are slower");
    case InterruptFault::dead:
      return options_.onAlarm(line +
                              "stays inactive although the chip has requests: the chip is polled, "
                              "and transfers are slower");
  }
}

}  // namespace mpf
