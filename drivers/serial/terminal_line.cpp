// SPDX-License-Identifier: MIT
#include "drivers/serial/terminal_line.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "base/system_call.h"
#include "drivers/serial/terminal_settings.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kShortestDrainCheck{1};
constexpr std::chrono::milliseconds kLongestDrainCheck{20};
constexpr int kFlushOutputQueue = 1;  // TCOFLUSH, which is in <termios.h>

}  // namespace

TerminalLine::TerminalLine(std::string device, const SerialSettings& settings)
    : device_(std::move(device)), settings_(settings) {
  if (const auto problem = problemOf(settings); !problem.empty())
    throw std::invalid_argument(fmt::format("{}: {}", device_, problem));
}

SerialLine::OpenState TerminalLine::tryOpen() {
  fd_.reset(retryInterrupted(
      [&] { return ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); }));
  if (!fd_) {
    problem_ = fmt::format(
        "open {}: {}", device_,
        errno == EBUSY ? "in use by another program" : std::generic_category().message(errno));
    return OpenState::failed;
  }
  if (const auto reason = tryPrepare(); !reason.empty()) {
    problem_ = fmt::format("open {}: {}", device_, reason);
    fd_.reset();
    return OpenState::failed;
  }
  decoder_ = {};
  errors_.begin(errorCounts());
  return OpenState::open;
}

// Returns empty or the reason. Changes nothing on a device that another program uses.
std::string TerminalLine::tryPrepare() const {
  if (::isatty(fd_.get()) == 0) return "not a terminal";
  if (::flock(fd_.get(), LOCK_EX | LOCK_NB) < 0) return "in use by another program";
  if (::ioctl(fd_.get(), TIOCEXCL) < 0)
    return "TIOCEXCL: " + std::generic_category().message(errno);
  auto reason = terminal::tryMakeRaw(fd_.get());
  if (reason.empty()) reason = terminal::tryApply(fd_.get(), settings_);
  if (!reason.empty()) ::ioctl(fd_.get(), TIOCNXCL);
  return reason;
}

void TerminalLine::closeDevice() noexcept {
  // Without TIOCNXCL the device would stay exclusive as long as another program has it open. On a
  // device that was unplugged the call fails, which does not matter.
  if (fd_) ::ioctl(fd_.get(), TIOCNXCL);
  fd_.reset();
}

void TerminalLine::note(const char* call, int error) {
  problem_ =
      fmt::format("{} {}: {}", call, device_,
                  error == 0 ? "the device hung up" : std::generic_category().message(error));
}

bool TerminalLine::tryRead(std::vector<LineByte>& bytes) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): read() fills it
  std::array<std::uint8_t, kReadBytes> raw;
  const auto length = retryInterrupted([&] { return ::read(fd_.get(), raw.data(), raw.size()); });
  if (length > 0) {
    append(std::span(raw).first(static_cast<std::size_t>(length)), bytes);
    return true;
  }
  if (length < 0 && errno == EAGAIN) return true;
  note("read", length == 0 ? 0 : errno);
  return false;
}

void TerminalLine::append(std::span<const std::uint8_t> raw, std::vector<LineByte>& bytes) {
  const bool hasParity = settings_.parity == 'E' || settings_.parity == 'O';
  const auto damage = errors_.take(errorCounts(), hasParity);
  const auto before = static_cast<std::ptrdiff_t>(bytes.size());
  decoder_.decode(raw, damage, bytes);
  if (!errors_.mayFollowGap()) return;
  std::for_each(bytes.begin() + before, bytes.end(),
                [](LineByte& byte) { byte.followsGap = true; });
}

std::optional<std::size_t> TerminalLine::tryWrite(std::span<const std::uint8_t> bytes) {
  const auto length =
      retryInterrupted([&] { return ::write(fd_.get(), bytes.data(), bytes.size()); });
  if (length >= 0) return static_cast<std::size_t>(length);
  if (errno == EAGAIN) return 0;
  note("write", errno);
  return std::nullopt;
}

std::chrono::milliseconds TerminalLine::timeToSend() const {
  int unsent = 0;
  if (::ioctl(fd_.get(), TIOCOUTQ, &unsent) < 0 || unsent <= 0) return {};
  const auto needed =
      std::chrono::duration_cast<std::chrono::milliseconds>(terminal::timeFor(fd_.get(), unsent));
  return std::clamp(needed, kShortestDrainCheck, kLongestDrainCheck);
}

void TerminalLine::discardUnsent() noexcept { ::ioctl(fd_.get(), TCFLSH, kFlushOutputQueue); }

std::optional<TerminalErrors::Counts> TerminalLine::errorCounts() const noexcept {
  serial_icounter_struct counts{};
  if (::ioctl(fd_.get(), TIOCGICOUNT, &counts) < 0) return std::nullopt;
  return TerminalErrors::Counts{
      static_cast<unsigned>(counts.frame),
      static_cast<unsigned>(counts.overrun) + static_cast<unsigned>(counts.buf_overrun)};
}

std::uint64_t TerminalLine::takeOverruns() noexcept { return errors_.takeOverruns(); }

std::string TerminalLine::tryConfigure(const SerialSettings& settings) {
  auto refused = terminal::tryApply(fd_.get(), settings);
  if (refused.empty()) settings_ = merged(settings_, settings);
  return refused;
}

bool TerminalLine::trySetBreak(bool on) noexcept {
  return ::ioctl(fd_.get(), on ? TIOCSBRK : TIOCCBRK) == 0;
}

}  // namespace mpf
