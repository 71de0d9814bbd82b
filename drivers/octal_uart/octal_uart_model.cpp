// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_model.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <span>

#include <mpf/clock.h>
#include <mpf/drivers/industry_pack/module.h>

#include "base/signals_blocked.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;

constexpr std::size_t kChannelBytes = 0x10;
constexpr std::uint8_t kVectorAtPowerUp = 0x0f;
constexpr std::size_t kMaxIncoming = 4096;  // from a terminal; more bytes stay in the kernel
constexpr std::int64_t kCheckRoomEveryNs = 5'000'000;

}  // namespace

OctalUartModel::OctalUartModel(const OctalUartModelOptions& options)
    : DeviceModel({.manufacturer = kGreenSpring, .model = options.model, .revision = 0xa1}),
      options_(options),
      wakeUp_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for a model")) {
  if (options.terminals) {
    for (auto& terminal : terminals_) terminal = openTerminal();
  }
  if (!options.terminals && options.time != OctalUartModelTime::clock) return;
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

OctalUartModel::~OctalUartModel() {
  thread_.request_stop();
  ::eventfd_write(wakeUp_.get(), 1);
}

OctalUartModel::Terminal OctalUartModel::openTerminal() {
  Terminal terminal;
  terminal.master.reset(
      checkCall(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK), "posix_openpt"));
  checkCall(::grantpt(terminal.master.get()), "grantpt");
  checkCall(::unlockpt(terminal.master.get()), "unlockpt");
  terminal.path.resize(64);
  if (const int error =
          ::ptsname_r(terminal.master.get(), terminal.path.data(), terminal.path.size());
      error != 0)
    throwSystemError(error, "ptsname_r", "of a pseudo-terminal");
  terminal.path.resize(terminal.path.find('\0'));
  terminal.slave.reset(checkCall(::open(terminal.path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC),
                                 "open", terminal.path));
  termios raw{};
  checkCall(::tcgetattr(terminal.slave.get(), &raw), "tcgetattr", terminal.path);
  ::cfmakeraw(&raw);
  checkCall(::tcsetattr(terminal.slave.get(), TCSANOW, &raw), "tcsetattr", terminal.path);
  return terminal;
}

// ---- bus

std::uint16_t OctalUartModel::read(Space space, std::size_t offset, Lanes lanes) {
  constexpr std::uint16_t kUndriven = 0xff00;
  if ((lanes & kLow) == 0) return kUndriven;
  const std::lock_guard lock(mutex_);
  if (space == Space::memory) return kUndriven | (offset == 0 ? vector_ : 0xff);
  noteAccess(offset);
  const auto value = readRegister(offset + 1);
  proceed();
  return kUndriven | value;
}

void OctalUartModel::write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) {
  if ((lanes & kLow) == 0) return;
  const std::lock_guard lock(mutex_);
  ++writes_;
  const auto byte = static_cast<std::uint8_t>(value);
  if (space == Space::io) {
    noteAccess(offset);
    writeRegister(offset + 1, byte);
    proceed();
  } else if (offset == 0) {
    vector_ = byte;
  }
}

std::uint8_t OctalUartModel::readRegister(std::size_t offset) {
  auto& channel = channels_.at(offset / kChannelBytes);
  switch (offset % kChannelBytes) {
    case kMr:
      return channel.readMr();
    case kSr:
      return channel.readSr();
    case kRhr:
      return channel.readRhr();
    case kIsr:
      return offset / kChannelBytes % 2 == 0
                 ? isrOfBlock(static_cast<int>(offset / kChannelBytes / 2))
                 : 0;
    default:
      return 0;
  }
}

void OctalUartModel::writeRegister(std::size_t offset, std::uint8_t value) {
  const auto number = offset / kChannelBytes;
  auto& channel = channels_.at(number);
  switch (offset % kChannelBytes) {
    case kMr:
      return channel.writeMr(value);
    case kCsr:
      return channel.writeCsr(value);
    case kCr:
      return channel.writeCr(value);
    case kThr:
      return channel.writeThr(value);
    case kImr:
      if (number % 2 == 0) imr_.at(number / 2) = value;
      return;
    default:
      return;
  }
}

std::uint8_t OctalUartModel::isrOfBlock(int block) const {
  const auto& a = channels_.at(index(2 * block));
  const auto& b = channels_.at(index(2 * block + 1));
  return static_cast<std::uint8_t>(a.isr() | b.isr() << 4);
}

std::uint8_t OctalUartModel::vector() const {
  const std::lock_guard lock(mutex_);
  return vector_;
}

std::chrono::nanoseconds OctalUartModel::takeLongestWait() {
  const std::lock_guard lock(mutex_);
  return std::chrono::nanoseconds(std::exchange(longestWaitNs_, 0));
}

std::uint64_t OctalUartModel::writes() const {
  const std::lock_guard lock(mutex_);
  return writes_;
}

void OctalUartModel::reset() {
  const std::lock_guard lock(mutex_);
  for (auto& channel : channels_) channel = {};
  imr_ = {};
  vector_ = kVectorAtPowerUp;
  proceed();
}

// ---- effects of an access, or of time

std::int64_t OctalUartModel::nowNs() const {
  return options_.time == OctalUartModelTime::clock ? Clock::nowNs() : steppedNs_;
}

void OctalUartModel::proceed() {
  const bool takesTime = options_.time != OctalUartModelTime::instant;
  const bool mayLag = options_.time == OctalUartModelTime::clock;
  auto next = INT64_MAX;
  for (auto& channel : channels_) {
    const auto before = channel.nextEventNs();
    channel.runUntil(nowNs(), takesTime, mayLag);
    if (channel.nextEventNs() < before) next = std::min(next, channel.nextEventNs());
  }
  sendToTerminals();
  followInterrupts();
  changed_.notify_all();
  if (mayLag && next != INT64_MAX && thread_.get_id() != std::this_thread::get_id())
    ::eventfd_write(wakeUp_.get(), 1);
}

void OctalUartModel::sendToTerminals() {
  if (!options_.terminals) return;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    auto& bytes = channels_.at(i).outgoing;
    if (bytes.empty()) continue;
    [[maybe_unused]] const auto written =
        ::write(terminals_.at(i).master.get(), bytes.data(), bytes.size());
    bytes.clear();
  }
}

void OctalUartModel::followInterrupts() {
  for (int line = 0; line < 2; ++line) {
    bool active = false;
    for (const int block : {2 * line, 2 * line + 1})
      active = active || (isrOfBlock(block) & imr_.at(index(block))) != 0;
    if (std::exchange(isActive_.at(index(line)), active) == active) continue;
    waitsSinceNs_.at(index(line)) = nowNs();
    setInterrupt(line, active);
  }
}

void OctalUartModel::noteAccess(std::size_t offset) {
  if (options_.time != OctalUartModelTime::clock) return;
  const auto half = std::min<std::size_t>(offset / (kChannelBytes * kChannels / 2), 1);
  const auto since = std::exchange(waitsSinceNs_.at(half), nowNs());
  if (isActive_.at(half)) longestWaitNs_ = std::max(longestWaitNs_, waitsSinceNs_.at(half) - since);
}

// ---- far ends

void OctalUartModel::farEndSend(int port, std::string_view text, LineFault fault) {
  const std::lock_guard lock(mutex_);
  for (const char byte : text)
    channels_.at(index(port)).incoming.push_back({static_cast<std::uint8_t>(byte), fault});
  proceed();
}

std::string OctalUartModel::farEndReceived(int port) const {
  const std::lock_guard lock(mutex_);
  return channels_.at(index(port)).outgoing;
}

void OctalUartModel::waitUntilFarEndReceived(int port, std::string_view text) const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return channels_.at(index(port)).outgoing.ends_with(text); });
}

void OctalUartModel::setClearToSend(int port, bool clear) {
  const std::lock_guard lock(mutex_);
  channels_.at(index(port)).setClearToSend(clear);
  proceed();
}

// ---- time

void OctalUartModel::advance(std::chrono::nanoseconds time) {
  const std::lock_guard lock(mutex_);
  steppedNs_ += time.count();
  proceed();
}

void OctalUartModel::waitUntilServed() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !isActive_[0] && !isActive_[1]; });
}

void OctalUartModel::run(const std::stop_token& stop) {
  std::array<pollfd, kChannels + 1> entries{};
  while (!stop.stop_requested()) {
    const auto wait = Deadline::atNs(wakeAtNs());
    for (std::size_t i = 0; i < terminals_.size(); ++i) {
      const bool mayRead = options_.terminals && with(static_cast<int>(i), [](const auto& channel) {
                             return channel.incoming.size() < kMaxIncoming;
                           });
      entries.at(i) = {
          .fd = mayRead ? terminals_.at(i).master.get() : -1, .events = POLLIN, .revents = 0};
    }
    entries.back() = {.fd = wakeUp_.get(), .events = POLLIN, .revents = 0};
    const auto timeout = timespecOf(wait.left());
    ::ppoll(entries.data(), entries.size(), wait.isNever() ? nullptr : &timeout, nullptr);
    eventfd_t rings = 0;
    static_cast<void>(::eventfd_read(wakeUp_.get(), &rings));
    std::array<short, kChannels> events{};
    std::ranges::transform(std::span(entries).first(kChannels), events.begin(), &pollfd::revents);
    readTerminals(events);
  }
}

// A terminal whose bytes exceed kMaxIncoming is not polled; its room is checked again after
// kCheckRoomEveryNs.
std::int64_t OctalUartModel::wakeAtNs() {
  const std::lock_guard lock(mutex_);
  auto next = INT64_MAX;
  for (const auto& channel : channels_) {
    if (options_.time == OctalUartModelTime::clock) next = std::min(next, channel.nextEventNs());
    if (channel.incoming.size() >= kMaxIncoming)
      next = std::min(next, Clock::nowNs() + kCheckRoomEveryNs);
  }
  return next;
}

void OctalUartModel::readTerminals(std::span<const short> events) {
  const std::lock_guard lock(mutex_);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): read() fills it
  std::array<std::uint8_t, 1024> bytes;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if ((events[i] & POLLIN) == 0) continue;
    const auto length = ::read(terminals_.at(i).master.get(), bytes.data(), bytes.size());
    for (ssize_t k = 0; k < length; ++k)
      channels_.at(i).incoming.push_back({bytes.at(static_cast<std::size_t>(k)), LineFault::none});
  }
  proceed();
}

}  // namespace mpf
