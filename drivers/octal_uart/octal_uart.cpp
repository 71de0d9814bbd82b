// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;

constexpr std::uint16_t kOctal485 = 0x48;
constexpr int kBlocksPerLine = 2;
// For each interrupt. If the chip still has a request then, the line is still active, and the next
// interrupt follows.
constexpr int kMaxPasses = 64;
constexpr int kPortsPerLine = 4;
constexpr std::size_t kMaxPendingAlarms = 100;  // until a handler is set

OctalUartOptions checked(const OctalUartOptions& options, IndustryPackModule& module) {
  if (options.ports != 4 && options.ports != 8)
    throw std::invalid_argument(
        fmt::format("module \"{}\": {} ports: a module has 4 or 8", module.name(), options.ports));
  static_cast<void>(module.checkedVector(options.vector));
  if (module.memory().size() == 0) {
    throw IndustryPackError(
        IndustryPackStatus::badAddress,
        fmt::format("module \"{}\": {} has no memory space, which contains the interrupt vector "
                    "register: set the memory of the site in the parameters of the carrier",
                    module.name(), module.where()));
  }
  return options;
}

}  // namespace

OctalUart::OctalUart(IndustryPackModule& module, const OctalUartOptions& options)
    : module_(module),
      io_(module.io()),
      options_(checked(options, module)),
      isRs485_(module.idProm().model == kOctal485),
      isReserved_(static_cast<std::size_t>(options.ports)) {
  channels_.reserve(kChannels);
  for (int i = 0; i < kChannels; ++i)
    channels_.emplace_back(io_, i, isRs485_, imr_.at(static_cast<std::size_t>(i / 2)));
  setUp();
  for (const int line : {1, 0}) startThread(line);
}

OctalUart::~OctalUart() {
  for (auto& thread : threads_) thread.reset();
  const std::lock_guard lock(mutex_);
  loseIfAbsent(true);
  if (!isReady_) return;  // lost: the site may be empty or have another module
  for (auto& channel : channels_) channel.close();
}

void OctalUart::startThread(int line) {
  InterruptThreadOptions options{.pollEvery = options_.pollEvery,
                                 .stormLimit = options_.stormLimit,
                                 .stormPause = options_.stormPause};
  // A Quad module has no ports on its second request line.
  if (line * kPortsPerLine >= options_.ports) options.pollEvery = {};
  threads_.at(static_cast<std::size_t>(line)) = std::make_unique<InterruptThread>(
      module_.interrupt(line), options,
      [this, line](InterruptThread::Cause cause) { return serve(line, cause); },
      [this, line](InterruptFault fault) { note(line, fault); });
}

void OctalUart::onAlarm(AlarmHandler handler) {
  const std::lock_guard lock(alarmMutex_);
  alarmHandler_ = std::move(handler);
}

OctalUart::Counters OctalUart::counters() const {
  Counters counters;
  for (const auto& thread : threads_) {
    counters.interrupts += thread->counters().interrupts;
    counters.spurious += thread->counters().spurious;
  }
  const std::lock_guard lock(mutex_);
  counters.alarms = alarmCount_;
  return counters;
}

// ---- ports

void OctalUart::reservePort(int number) {
  const std::lock_guard lock(mutex_);
  if (number < 0 || number >= options_.ports) {
    throw std::invalid_argument(fmt::format("module \"{}\": port {}: the module has ports 0 to {}",
                                            module_.name(), number, options_.ports - 1));
  }
  if (isReserved_[static_cast<std::size_t>(number)])
    throw std::invalid_argument(
        fmt::format("module \"{}\": port {} is in use", module_.name(), number));
  isReserved_[static_cast<std::size_t>(number)] = true;
}

void OctalUart::releasePort(int number) noexcept {
  const std::lock_guard lock(mutex_);
  isReserved_[static_cast<std::size_t>(number)] = false;
}

std::string OctalUart::tryOpen(int number, const SerialSettings& settings) {
  const std::lock_guard lock(mutex_);
  loseIfAbsent(true);
  if (!isReady_) {
    if (auto problem = module_.problem(); !problem.empty()) return problem;
  }
  // Resets are detected only while a port is open, so the first port sets the chip up.
  if (!isReady_ || std::ranges::none_of(channels_, &OctalUartChannel::isOpen)) setUp();
  channels_[static_cast<std::size_t>(number)].open(settings);
  return {};
}

// Sets up all channels, also those of a Quad module that have no port: their inputs float, and must
// not cause interrupts.
void OctalUart::setUp() {
  for (int block = 0; block < kBlocks; ++block) {
    imr_.at(static_cast<std::size_t>(block)) = 0;
    io_.write8(atBlock(block, kImr), 0);
    io_.write8(atBlock(block, kAcr), kAcrSet2);
    io_.write8(atBlock(block, kOpcr), kOpcrMppOutput);
  }
  for (auto& channel : channels_) channel.close();
  module_.memory().write8(kVector, static_cast<std::uint8_t>(options_.vector));
  isReady_ = true;
}

// ---- interrupts

bool OctalUart::serve(int line, InterruptThread::Cause cause) {
  bool hadRequest = false;
  {
    const std::lock_guard lock(mutex_);
    hadRequest =
        cause == InterruptThread::Cause::interrupt ? serveInterrupt(line) : servePoll(line);
  }
  reportAlarms();
  return hadRequest;
}

// Serves the half of the chip that belongs to this line. If it has no request, serves the other
// half, because some boards have one line only.
bool OctalUart::serveInterrupt(int line) {
  const int first = line * kBlocksPerLine;
  return serveBlocks(first, kBlocksPerLine) || serveBlocks(kBlocksPerLine - first, kBlocksPerLine);
}

bool OctalUart::servePoll(int line) {
  const bool isLate = serveBlocks(line * kBlocksPerLine, kBlocksPerLine);
  if (line == 0) checkPresence();
  return isLate;
}

void OctalUart::note(int line, InterruptFault fault) {
  {
    const std::lock_guard lock(mutex_);
    raise(fault == InterruptFault::storm ? OctalUartAlarm::storm : OctalUartAlarm::noInterrupts,
          textOf(line, fault));
  }
  reportAlarms();
}

std::string OctalUart::textOf(int line, InterruptFault fault) const {
  auto which = fmt::format("module \"{}\" ({}), ports {} to {}: interrupt line {}", module_.name(),
                           module_.where(), line * kPortsPerLine,
                           line * kPortsPerLine + kPortsPerLine - 1, line);
  switch (fault) {
    case InterruptFault::storm:
      return fmt::format(
          "{} is stuck active without a request of the chip: it is masked for {} ms at a time "
          "until it is released",
          which, options_.stormPause.count());
    case InterruptFault::polled:
      return fmt::format(
          "{} is polled by its carrier from now on, which is too slow for fast lines", which);
    case InterruptFault::dead:
      return fmt::format(
          "{} stays inactive although the chip has requests: it is polled every {} ms, which is "
          "too slow for fast lines",
          which, options_.pollEvery.count());
  }
  return which;
}

// Serves the blocks in turn until none of them has a request. Serving one block to its end would
// delay the others for as long as it has requests.
bool OctalUart::serveBlocks(int first, int count) {
  bool hadRequest = false;
  for (int pass = 0; pass < kMaxPasses && isReady_; ++pass) {
    bool hasRequest = false;
    for (int block = first; block < std::min(first + count, options_.ports / 2) && isReady_;
         ++block) {
      const auto pending = pendingOf(block);
      if (pending == 0) continue;
      hasRequest = true;
      serveBlock(block, pending);
    }
    if (!hasRequest) break;
    hadRequest = true;
  }
  return hadRequest;
}

std::uint8_t OctalUart::pendingOf(int block) {
  const auto isr = io_.read8(atBlock(block, kIsr));
  loseIfAbsent(isr == kOnes);
  return isReady_ ? isr & imr_.at(static_cast<std::size_t>(block)) : 0;
}

void OctalUart::serveBlock(int block, std::uint8_t pending) {
  for (const int number : {2 * block, 2 * block + 1}) {
    const auto ours = static_cast<std::uint8_t>((number % 2 == 0 ? pending : pending >> 4) & 0xf);
    auto& channel = channels_[static_cast<std::size_t>(number)];
    if (ours == 0 || channel.serve(ours, false)) continue;
    loseIfAbsent(true);
    if (isReady_) static_cast<void>(channel.serve(ours, true));
  }
}

// ---- presence

void OctalUart::checkPresence() {
  for (auto& channel : channels_) {
    if (!isReady_ || !channel.isOpen() || channel.isAsConfigured()) continue;
    loseIfAbsent(true);
    if (isReady_) lose("the module has been reset");
  }
}

// Reads the ID PROM when the module may be absent. A register of a module that is present may read
// as all ones; its ID PROM never does.
void OctalUart::loseIfAbsent(bool isSuspected) {
  if (!isSuspected || !isReady_) return;
  if (const auto problem = module_.problem(); !problem.empty()) lose(problem);
}

void OctalUart::lose(const std::string& because) {
  isReady_ = false;
  for (auto& channel : channels_) channel.lose(because);
  raise(OctalUartAlarm::lost, fmt::format("module \"{}\": {}", module_.name(), because));
}

void OctalUart::raise(OctalUartAlarm alarm, std::string what) {
  ++alarmCount_;
  if (pendingAlarms_.size() < kMaxPendingAlarms)
    pendingAlarms_.emplace_back(alarm, std::move(what));
}

void OctalUart::reportAlarms() {
  const std::lock_guard handlerLock(alarmMutex_);
  if (!alarmHandler_) return;
  std::vector<std::pair<OctalUartAlarm, std::string>> alarms;
  {
    const std::lock_guard lock(mutex_);
    alarms.swap(pendingAlarms_);
  }
  for (const auto& [alarm, what] : alarms) alarmHandler_(alarm, what);
}

}  // namespace mpf
