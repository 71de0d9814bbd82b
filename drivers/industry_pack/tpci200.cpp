// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/tpci200.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <mpf/drivers/industry_pack/industry_pack_error.h>
#include <mpf/real_time_priority.h>

#include "base/number.h"
#include "base/signals_blocked.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf {
namespace {

const PciKind kTpci200{.name = "TPCI200", .vendor = 0x1498, .device = 0x30c8};

// Another process may hold the lock of a site for a moment, in maskIfUnowned().
constexpr int kClaims = 50;
constexpr std::chrono::milliseconds kClaimAgain{1};
// Time for another process to mask its line before the interrupt is unmasked again.
constexpr std::chrono::microseconds kForOthers{100};

}  // namespace

Tpci200Options Tpci200Options::parse(const std::string& parameters) {
  constexpr std::string_view kPoll = "poll=";
  const auto refuse = [&](const std::string& problem) {
    throw IndustryPackError(
        IndustryPackStatus::badAddress,
        fmt::format("TPCI200 \"{}\": {}; use [ADDRESS|NUMBER][,poll=MICROSECONDS]", parameters,
                    problem));
  };
  Tpci200Options options;
  const auto comma = parameters.find(',');
  options.board = parameters.substr(0, comma);
  if (options.board.find_first_not_of("0123456789abcdefABCDEF:.") != std::string::npos)
    refuse(fmt::format("\"{}\" is not a PCI address", options.board));
  if (comma == std::string::npos) return options;
  const auto rest = parameters.substr(comma + 1);
  if (!rest.starts_with(kPoll)) refuse(fmt::format("unknown parameter \"{}\"", rest));
  const auto microseconds = tryNumber<long>(std::string_view(rest).substr(kPoll.size()));
  if (!microseconds || *microseconds < 1 || *microseconds > 1'000'000)
    refuse(fmt::format("\"{}\": use 1 to 1000000 microseconds", rest));
  options.pollEvery = std::chrono::microseconds(*microseconds);
  return options;
}

// An interrupt request line of a module. It passes on one interrupt and is then masked until
// enable().
class Tpci200Line final : public Interrupt {
 public:
  Tpci200Line(Tpci200Site& site, int number) : site_(site), number_(number) {}
  void enable() override;
  void disable() noexcept override;
  [[nodiscard]] bool isPolled() const noexcept override;
  void pass() noexcept { announce(); }

 private:
  Tpci200Site& site_;
  int number_;
};

class Tpci200Site final : public IndustryPackSite {
 public:
  Tpci200Site(Tpci200& carrier, std::size_t number)
      : carrier_(carrier),
        number_(number),
        id_(carrier.board_, number,
            carrier.pci_.map(Tpci200Board::kSitesWindow,
                             number * Tpci200Board::kSiteBytes + Tpci200Board::kIoBytes,
                             Tpci200Board::kIdBytes)),
        io_(carrier.board_, number,
            carrier.pci_.map(Tpci200Board::kSitesWindow, number * Tpci200Board::kSiteBytes,
                             Tpci200Board::kIoBytes)),
        memory_(carrier.board_, number,
                carrier.pci_.map(Tpci200Board::kMemoryWindow, number * Tpci200Board::kMemoryBytes,
                                 Tpci200Board::kMemoryBytes)) {}

  [[nodiscard]] Registers& id() override { return id_; }
  [[nodiscard]] Registers& io() override { return io_; }
  [[nodiscard]] Registers& memory() override { return memory_; }
  [[nodiscard]] Interrupt& interrupt(int number) override {
    return lines_.at(static_cast<std::size_t>(number));
  }

  void enable(int line) {
    {
      const std::lock_guard lock(mutex_);
      setEnabled(enabled_ | 1U << line);
    }
    carrier_.watch(lines_[static_cast<std::size_t>(line)].priority());
  }
  void disable(int line) noexcept {
    const std::lock_guard lock(mutex_);
    setEnabled(enabled_ & ~(1U << line));
  }
  [[nodiscard]] bool isPolled() const noexcept {
    return carrier_.isPolled_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool isAnyEnabled() {
    const std::lock_guard lock(mutex_);
    return enabled_ != 0;
  }
  // Announces the enabled lines that are active in the status of the board.
  void serve(std::uint16_t status) {
    const std::lock_guard lock(mutex_);
    for (int line = 0; line < 2; ++line) {
      if ((status & Tpci200Board::statusBit(number_, line)) == 0 || (enabled_ & 1U << line) == 0)
        continue;
      carrier_.board_.acknowledge(number_, line);
      setEnabled(enabled_ & ~(1U << line));
      lines_[static_cast<std::size_t>(line)].pass();
    }
  }

 private:
  void setEnabled(unsigned lines) {
    enabled_ = lines;
    carrier_.board_.setLines(number_, lines);
  }

  Tpci200& carrier_;
  std::size_t number_;
  Tpci200Registers id_;
  Tpci200Registers io_;
  Tpci200Registers memory_;
  std::mutex mutex_;
  unsigned enabled_ = 0;  // bit n: line n
  std::array<Tpci200Line, 2> lines_{{{*this, 0}, {*this, 1}}};
};

void Tpci200Line::enable() { site_.enable(number_); }
void Tpci200Line::disable() noexcept { site_.disable(number_); }
bool Tpci200Line::isPolled() const noexcept { return site_.isPolled(); }

Tpci200::Tpci200(const Tpci200Options& options)
    : pci_(options.places, kTpci200, options.board),
      pollEvery_(options.pollEvery),
      board_(pci_),
      locks_(pci_.open(fmt::format("resource{}", Tpci200Board::kSitesWindow))),
      wakeUp_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for a carrier")) {
  openInterrupt();
}

Tpci200::~Tpci200() {
  thread_.request_stop();
  ::eventfd_write(wakeUp_.get(), 1);
  if (thread_.joinable()) thread_.join();
  for (std::size_t i = 0; i < kSites; ++i) {
    if (sites_[i]) board_.setLines(i, 0);
  }
}

void Tpci200::openInterrupt() {
  try {
    interrupt_ = std::make_unique<PciInterrupt>(pci_);
  } catch (const std::runtime_error& error) {
    pollFromNowOn();
    remark_ =
        fmt::format("its interrupts are polled, every {} us: {}", pollEvery_.count(), error.what());
  }
}

IndustryPackSite& Tpci200::site(std::size_t number) {
  const std::lock_guard lock(sitesMutex_);
  auto& site = sites_.at(number);
  if (!site) {
    if (!thread_.joinable()) startThread();
    claim(number);
    site = std::make_unique<Tpci200Site>(*this, number);
  }
  return *site;
}

void Tpci200::claim(std::size_t number) {
  for (int i = 0; !locks_.tryLock(static_cast<int>(number)); ++i) {
    if (i == kClaims)
      throw std::runtime_error(
          fmt::format("{}: site {} is in use by another process", description(), siteName(number)));
    std::this_thread::sleep_for(kClaimAgain);
  }
  board_.setLines(number, 0);  // the previous process may have been killed
}

// Before a line is enabled, because enable() cannot report a failure.
void Tpci200::startThread() {
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Tpci200::watch(int priority) noexcept {
  auto none = kNoLine;
  const bool isFirst = priority_.compare_exchange_strong(none, priority, std::memory_order_relaxed);
  if (isFirst || isPolled_.load(std::memory_order_relaxed)) ::eventfd_write(wakeUp_.get(), 1);
}

int Tpci200::awaitLine(const std::stop_token& stop) {
  pollfd woken{.fd = wakeUp_.get(), .events = POLLIN, .revents = 0};
  while (priority_.load(std::memory_order_relaxed) == kNoLine && !stop.stop_requested())
    ::poll(&woken, 1, -1);
  return priority_.load(std::memory_order_relaxed);
}

void Tpci200::run(const std::stop_token& stop) {
  RealTimePriority realTime(awaitLine(stop));
  while (!stop.stop_requested()) {
    if (!interrupt_) serve();
    wait();
    eventfd_t wakes = 0;
    ::eventfd_read(wakeUp_.get(), &wakes);
    if (interrupt_) takeInterrupt();
    realTime.check();
  }
}

void Tpci200::wait() {
  std::array<pollfd, 2> events{
      {{.fd = wakeUp_.get(), .events = POLLIN, .revents = 0},
       {.fd = interrupt_ ? interrupt_->descriptor() : -1, .events = POLLIN, .revents = 0}}};
  const auto timeout = timespecOf(pollEvery_);
  ::ppoll(events.data(), events.size(), hasSomethingToPoll() ? &timeout : nullptr, nullptr);
}

bool Tpci200::hasSomethingToPoll() {
  if (interrupt_) return false;
  const std::lock_guard lock(sitesMutex_);
  return std::ranges::any_of(sites_, [](const auto& site) { return site && site->isAnyEnabled(); });
}

void Tpci200::takeInterrupt() {
  try {
    if (!interrupt_->tryTake()) return;
  } catch (const std::system_error&) {
    interrupt_.reset();
    pollFromNowOn();  // the board was unbound from uio_pci_generic
    return;
  }
  if (serve()) {
    const auto pause = timespecOf(kForOthers);
    ::ppoll(nullptr, 0, &pause, nullptr);
  }
  interrupt_->unmask();
}

bool Tpci200::serve() {
  const auto status = board_.status();
  if (status == Tpci200Board::kGone) return false;
  const std::lock_guard lock(sitesMutex_);
  bool isOthers = false;
  for (std::size_t i = 0; i < kSites; ++i) {
    if ((status & (Tpci200Board::statusBit(i, 0) | Tpci200Board::statusBit(i, 1))) == 0) continue;
    if (sites_[i]) {
      sites_[i]->serve(status);
    } else {
      isOthers = true;
      maskIfUnowned(i);
    }
  }
  return isOthers;
}

void Tpci200::maskIfUnowned(std::size_t number) {
  if (!locks_.tryLock(static_cast<int>(number))) return;
  for (int line = 0; line < 2; ++line) board_.acknowledge(number, line);
  board_.setLines(number, 0);
  locks_.unlock(static_cast<int>(number));
}

}  // namespace mpf
