// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_line.h"

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf {
namespace {

constexpr SerialSettings kUsual{9600, 1, 8, 'N', 'N'};
constexpr std::chrono::milliseconds kShortestDrainCheck{1};
constexpr std::chrono::milliseconds kLongestDrainCheck{20};

void watch(const FileDescriptor& events, int descriptor) {
  epoll_event event{.events = EPOLLIN, .data = {.fd = descriptor}};
  checkCall(::epoll_ctl(events.get(), EPOLL_CTL_ADD, descriptor, &event), "epoll_ctl",
            "for a serial port");
}

}  // namespace

OctalUartLine::OctalUartLine(OctalUart& uart, int number, const SerialSettings& settings)
    : uart_(uart),
      number_(number),
      description_(
          fmt::format("port {} of {} ({})", number, uart.module().name(), uart.module().where())),
      settings_(merged(kUsual, settings)),
      timer_(checkCall(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK),
                       "timerfd_create", "for a serial port")),
      events_(checkCall(::epoll_create1(EPOLL_CLOEXEC), "epoll_create1", "for a serial port")) {
  if (const auto refused = octalUartProblemOf(settings, uart.isRs485()); !refused.empty())
    throw std::invalid_argument(fmt::format("{}: {}", description_, refused));
  uart.reservePort(number);
  watch(events_, uart.with(number, [](OctalUartChannel& channel) { return channel.bell(); }));
  watch(events_, timer_.get());
}

OctalUartLine::~OctalUartLine() {
  close();
  uart_.releasePort(number_);
}

SerialLine::OpenState OctalUartLine::tryOpen() {
  problem_ = uart_.tryOpen(number_, settings_);
  return problem_.empty() ? OpenState::open : OpenState::failed;
}

void OctalUartLine::close() noexcept {
  uart_.with(number_, [](OctalUartChannel& channel) {
    if (channel.isOpen()) channel.close();
  });
}

bool OctalUartLine::isThere(OctalUartChannel& channel) {
  if (!channel.isOpen()) problem_ = channel.lostBecause();
  return channel.isOpen();
}

bool OctalUartLine::tryRead(std::vector<LineByte>& bytes) {
  return uart_.with(number_, [&](OctalUartChannel& channel) {
    channel.take(bytes);
    overruns_ += channel.takeOverruns();  // under the same lock, so they belong to these bytes
    turnOrWait(channel);
    return isThere(channel);
  });
}

std::optional<std::size_t> OctalUartLine::tryWrite(std::span<const std::uint8_t> bytes) {
  return uart_.with(number_, [&](OctalUartChannel& channel) -> std::optional<std::size_t> {
    if (!isThere(channel)) return std::nullopt;
    return channel.put(bytes);
  });
}

// RS-485: switches the transmitter off when all bytes are sent, or sets the timer to try again. The
// end of the last byte causes no interrupt, so the chip must be polled for it.
void OctalUartLine::turnOrWait(OctalUartChannel& channel) const {
  std::uint64_t expirations = 0;
  static_cast<void>(::read(timer_.get(), &expirations, sizeof expirations));
  channel.tryTurn();
  if (!channel.waitsForTurn()) return;
  const auto wait = channel.timeToSend() / 4;
  const itimerspec when{.it_interval = {}, .it_value = timespecOf(wait)};
  ::timerfd_settime(timer_.get(), 0, &when, nullptr);
}

std::chrono::milliseconds OctalUartLine::timeToSend() const {
  const auto needed =
      uart_.with(number_, [](OctalUartChannel& channel) { return channel.timeToSend(); });
  if (needed.count() == 0) return {};
  return std::clamp(std::chrono::duration_cast<std::chrono::milliseconds>(needed),
                    kShortestDrainCheck, kLongestDrainCheck);
}

void OctalUartLine::discardUnsent() noexcept {
  uart_.with(number_, [](OctalUartChannel& channel) { channel.discardUnsent(); });
}

std::uint64_t OctalUartLine::takeOverruns() noexcept { return std::exchange(overruns_, 0); }

std::string OctalUartLine::tryConfigure(const SerialSettings& settings) {
  if (auto refused = octalUartProblemOf(settings, uart_.isRs485()); !refused.empty())
    return refused;
  settings_ = merged(settings_, settings);
  uart_.with(number_, [&](OctalUartChannel& channel) {
    if (channel.isOpen()) channel.configure(settings_);
  });
  return {};
}

bool OctalUartLine::trySetBreak(bool on) noexcept {
  return uart_.with(number_, [&](OctalUartChannel& channel) {
    if (!isThere(channel)) return false;
    channel.setBreak(on);
    turnOrWait(channel);
    return true;
  });
}

}  // namespace mpf
