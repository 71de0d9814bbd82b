// SPDX-License-Identifier: MIT
#include "drivers/serial/terminal_settings.h"

// termios2 is declared by the kernel's header. <termios.h> declares another struct termios, and
// cannot be included in the same file.
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fmt/format.h>

#include "base/system_call.h"

namespace mpf::terminal {
namespace {

struct Speed {
  unsigned baud;
  unsigned flag;
};
// These speeds are set by their constants, so that programs that use termios show them. All other
// speeds are set with BOTHER.
constexpr std::array kNamedSpeeds = {
    Speed{50, B50},           Speed{75, B75},           Speed{110, B110},
    Speed{134, B134},         Speed{150, B150},         Speed{200, B200},
    Speed{300, B300},         Speed{600, B600},         Speed{1200, B1200},
    Speed{1800, B1800},       Speed{2400, B2400},       Speed{4800, B4800},
    Speed{9600, B9600},       Speed{19200, B19200},     Speed{38400, B38400},
    Speed{57600, B57600},     Speed{115200, B115200},   Speed{230400, B230400},
    Speed{460800, B460800},   Speed{500000, B500000},   Speed{576000, B576000},
    Speed{921600, B921600},   Speed{1000000, B1000000}, Speed{1152000, B1152000},
    Speed{1500000, B1500000}, Speed{2000000, B2000000}, Speed{2500000, B2500000},
    Speed{3000000, B3000000}, Speed{3500000, B3500000}, Speed{4000000, B4000000}};
constexpr std::array<unsigned, 4> kCharSizes = {CS5, CS6, CS7, CS8};
constexpr int kShortestChar = 5;

// A receiver still samples the tenth bit correctly when the speeds differ by up to 5 %. Half of
// that is left for the far end.
constexpr long kTolerancePercent = 2;

void setFlags(unsigned& flags, unsigned mask, unsigned value) noexcept {
  flags = (flags & ~mask) | value;
}

void setBaud(termios2& line, unsigned baud) noexcept {
  const auto* named = std::find_if(kNamedSpeeds.begin(), kNamedSpeeds.end(),
                                   [&](const Speed& speed) { return speed.baud == baud; });
  setFlags(line.c_cflag, CBAUD | (CBAUD << IBSHIFT),
           named == kNamedSpeeds.end() ? unsigned{BOTHER} : named->flag);
  line.c_ospeed = baud;
  line.c_ispeed = baud;
}

bool isNear(unsigned baud, int wanted) noexcept {
  return std::labs(long{baud} - wanted) * 100 <= wanted * kTolerancePercent;
}

int bitsPerChar(const termios2& line) noexcept {
  const auto* size = std::find(kCharSizes.begin(), kCharSizes.end(), line.c_cflag & CSIZE);
  return kShortestChar + static_cast<int>(size - kCharSizes.begin());
}

int stopBits(const termios2& line) noexcept { return (line.c_cflag & CSTOPB) != 0 ? 2 : 1; }

char parity(const termios2& line) noexcept {
  if ((line.c_cflag & PARENB) == 0) return 'N';
  return (line.c_cflag & PARODD) != 0 ? 'O' : 'E';
}

char flowControl(const termios2& line) noexcept {
  return (line.c_cflag & CRTSCTS) != 0 ? 'H' : 'N';
}

termios2 with(termios2 line, const SerialSettings& settings) noexcept {
  auto& flags = line.c_cflag;
  if (settings.baud != 0) setBaud(line, static_cast<unsigned>(settings.baud));
  if (settings.stopBits != 0) setFlags(flags, CSTOPB, settings.stopBits == 2 ? CSTOPB : 0);
  if (settings.bitsPerChar != 0)
    setFlags(flags, CSIZE,
             kCharSizes.at(static_cast<std::size_t>(settings.bitsPerChar - kShortestChar)));
  if (settings.parity != 0) {
    setFlags(flags, PARENB | PARODD | CMSPAR,
             (settings.parity == 'N' ? 0 : PARENB) | (settings.parity == 'O' ? PARODD : 0));
  }
  if (settings.flowControl != 0)
    setFlags(flags, CRTSCTS, settings.flowControl == 'H' ? CRTSCTS : 0);
  return line;
}

// Names the first setting that the line did not accept; empty when it accepted all.
std::string refusal(const SerialSettings& asked, const termios2& is) {
  const auto sentence = [](const char* what, auto wanted, auto got) {
    return fmt::format("the line does not accept {} {}: it keeps {}", what, wanted, got);
  };
  if (asked.baud != 0 && !isNear(is.c_ospeed, asked.baud))
    return sentence("baud", asked.baud, is.c_ospeed);
  if (asked.stopBits != 0 && asked.stopBits != stopBits(is))
    return sentence("stop bits", asked.stopBits, stopBits(is));
  if (asked.bitsPerChar != 0 && asked.bitsPerChar != bitsPerChar(is)) {
    return sentence("bits per character", asked.bitsPerChar, bitsPerChar(is));
  }
  if (asked.parity != 0 && asked.parity != parity(is))
    return sentence("parity", asked.parity, parity(is));
  if (asked.flowControl != 0 && asked.flowControl != flowControl(is))
    return sentence("flow control", asked.flowControl, flowControl(is));
  return {};
}

std::string failed(const char* call) {
  return fmt::format("{}: {}", call, std::generic_category().message(errno));
}

}  // namespace

std::string tryMakeRaw(int fd) {
  termios2 line{};
  if (::ioctl(fd, TCGETS2, &line) < 0) return failed("TCGETS2");
  line.c_iflag = INPCK | PARMRK;
  line.c_oflag = 0;
  line.c_lflag = 0;
  line.c_cflag |= CREAD | CLOCAL;
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  return ::ioctl(fd, TCSETS2, &line) < 0 ? failed("TCSETS2") : std::string();
}

std::string tryApply(int fd, const SerialSettings& settings) {
  if (settings == SerialSettings{}) return {};
  termios2 before{};
  if (::ioctl(fd, TCGETS2, &before) < 0) return failed("TCGETS2");
  const auto wanted = with(before, settings);
  termios2 is{};
  if (::ioctl(fd, TCSETS2, &wanted) < 0) return failed("TCSETS2");
  if (::ioctl(fd, TCGETS2, &is) < 0) return failed("TCGETS2");
  auto refused = refusal(settings, is);
  if (!refused.empty() && ::ioctl(fd, TCSETS2, &before) < 0) return failed("TCSETS2");
  return refused;
}

std::chrono::microseconds timeFor(int fd, int bytes) {
  termios2 line{};
  if (::ioctl(fd, TCGETS2, &line) < 0 || line.c_ospeed == 0) return {};
  const int bits = 1 + bitsPerChar(line) + (parity(line) == 'N' ? 0 : 1) + stopBits(line);
  return std::chrono::microseconds(std::int64_t{1'000'000} * bits * bytes / line.c_ospeed);
}

}  // namespace mpf::terminal
