// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_channel.h"

#include <sys/eventfd.h>

#include <algorithm>
#include <utility>

#include "base/system_call.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;

// The most bytes in each direction for one serve(), so that no channel delays the others.
constexpr int kMaxBytesAtOnce = 64;

// The fault that the status register reports for the byte that is read next. A break is a byte of
// zeros without a stop bit, so it has precedence over a framing error.
LineFault faultOf(std::uint8_t sr) noexcept {
  if ((sr & kSrBreak) != 0) return LineFault::breakSignal;
  if ((sr & kSrFraming) != 0) return LineFault::framing;
  if ((sr & kSrParity) != 0) return LineFault::parity;
  return LineFault::none;
}

}  // namespace

OctalUartChannel::OctalUartChannel(Registers& io, int number, bool isRs485, std::uint8_t& imr)
    : io_(io),
      number_(number),
      isRs485_(isRs485),
      imr_(imr),
      bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for a serial port")) {}

// The chip needs some clocks between two commands to a channel. The read takes longer than that,
// and no bridge on the way lets it overtake the write.
void OctalUartChannel::command(unsigned value) {
  write(kCr, static_cast<std::uint8_t>(value));
  static_cast<void>(read(kSr));
}

void OctalUartChannel::setMask(std::uint8_t bits, bool on) {
  const auto ours = isrOf(number_, bits);
  const auto mask = static_cast<std::uint8_t>(on ? imr_ | ours : imr_ & ~ours);
  if (std::exchange(imr_, mask) != mask) io_.write8(atBlock(number_ / 2, kImr), mask);
}

void OctalUartChannel::open(const SerialSettings& settings) {
  close();
  received_.clear();
  overruns_ = gaps_ = 0;
  isCut_ = false;
  lostBecause_.clear();
  isOpen_ = true;
  configure(settings);
  setMask(kIsrRxRdy, true);
}

void OctalUartChannel::configure(const SerialSettings& settings) {
  mode_ = octalUartModeOf(settings);
  byteTime_ = byteTime(settings);
  command(kCrResetMr | kCrDisableRx | kCrDisableTx);
  write(kMr, mode_.mr1);
  write(kMr, mode_.mr2);
  write(kCsr, mode_.csr);
  // On an RS-485 port RTS switches the transmitter on.
  command((isRs485_ && !isTalking_ ? kCrNegateRts : kCrAssertRts) |
          (isTalking_ ? kCrDisableRx : kCrEnableRx) | kCrEnableTx);
}

void OctalUartChannel::close() {
  setMask(kIsrRxRdy | kIsrTxRdy | kIsrBreakChange, false);
  command(kCrResetMr | kCrDisableRx | kCrDisableTx);
  command(kCrResetRx);
  command(kCrResetTx);
  command(kCrResetErrors);
  command(kCrNegateRts);
  isOpen_ = isTalking_ = isBreaking_ = lacksRoom_ = false;
  unsent_.clear();
}

void OctalUartChannel::lose(const std::string& because) {
  if (!std::exchange(isOpen_, false)) return;
  isTalking_ = isBreaking_ = lacksRoom_ = false;
  unsent_.clear();
  lostBecause_ = because;
  ring();
}

// MR1 and MR2 have one address, which reads as MR2 once MR1 was accessed. After a reset it reads as
// 0 or MR1.
bool OctalUartChannel::isAsConfigured() { return read(kMr) == mode_.mr2; }

bool OctalUartChannel::serve(std::uint8_t isr, bool isPresent) {
  const auto before = received_.size();
  const auto isOnes = [isPresent](std::uint8_t sr) { return !isPresent && sr == kOnes; };
  auto sr = read(kSr);
  for (int i = 0; i < kMaxBytesAtOnce && (sr & kSrRxRdy) != 0 && !isOnes(sr); ++i) {
    receive(sr);
    sr = read(kSr);
  }
  noteEmpty(sr);
  const bool sends = (isr & kIsrTxRdy) != 0;
  if (sends && !isOnes(sr)) sr = transmit(sr, isPresent);
  if (unsent_.empty()) setMask(kIsrTxRdy, false);
  const bool hasRoom = lacksRoom_ && unsent_.size() <= kMaxUnsent / 2;
  const bool endsSoon = sends && unsent_.empty();
  if (received_.size() > before || hasRoom || endsSoon) ring();
  return !isOnes(sr);
}

// Writes as many bytes as the chip accepts now. Returns the status register after that.
std::uint8_t OctalUartChannel::transmit(std::uint8_t sr, bool isPresent) {
  for (int i = 0; i < kMaxBytesAtOnce && (sr & kSrTxRdy) != 0 && (isPresent || sr != kOnes) &&
                  !unsent_.empty();
       ++i) {
    write(kThr, unsent_.front());
    unsent_.pop_front();
    sr = read(kSr);
  }
  return sr;
}

// Resets the error bits before it reads the byte; after the read, the bits would be those of the
// next byte.
void OctalUartChannel::receive(std::uint8_t sr) {
  if ((sr & kSrErrors) != 0) command(kCrResetErrors);
  if ((sr & kSrOverrun) != 0) noteOverrun();
  const auto value = read(kRhr);
  const bool followsGap = takeGap();
  if (!isOpen_) return;
  if (received_.size() < kMaxReceived) {
    received_.push_back({value, faultOf(sr), followsGap || std::exchange(isCut_, false)});
  } else {
    ++overruns_;
    isCut_ = true;
  }
}

// The chip sets the overrun bit when it has lost the byte in its shift register; it keeps the three
// bytes of its FIFO. One of the three may have been read since the previous read of the status. So
// the byte that arrived after the lost one is the third or the fourth byte from now on.
void OctalUartChannel::noteOverrun() {
  constexpr unsigned kThirdAndFourth = 0b1100;
  ++overruns_;
  gaps_ |= kThirdAndFourth;
}

bool OctalUartChannel::takeGap() noexcept {
  const bool isHere = (gaps_ & 1) != 0;
  gaps_ >>= 1;
  return isHere;
}

// When the chip is empty, the byte after the gap has been read as well.
void OctalUartChannel::noteEmpty(std::uint8_t sr) noexcept {
  if ((sr & kSrRxRdy) == 0) gaps_ = 0;
}

void OctalUartChannel::take(std::vector<LineByte>& bytes) {
  eventfd_t rings = 0;
  static_cast<void>(::eventfd_read(bell_.get(), &rings));
  bytes.insert(bytes.end(), received_.begin(), received_.end());
  received_.clear();
}

std::uint64_t OctalUartChannel::takeOverruns() noexcept { return std::exchange(overruns_, 0); }

std::size_t OctalUartChannel::put(std::span<const std::uint8_t> bytes) {
  const auto fits = std::min(bytes.size(), kMaxUnsent - unsent_.size());
  lacksRoom_ = fits < bytes.size();
  if (fits == 0) return 0;
  unsent_.insert(unsent_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(fits));
  talk();
  static_cast<void>(transmit(read(kSr), false));
  if (!unsent_.empty()) setMask(kIsrTxRdy, true);
  return fits;
}

void OctalUartChannel::discardUnsent() {
  unsent_.clear();
  lacksRoom_ = false;
  if (!isOpen_) return;
  setMask(kIsrTxRdy, false);
  // Two writes: the Philips data sheets of this family forbid these two commands in one write.
  command(kCrResetTx);
  command(kCrEnableTx);
  tryTurn();
}

void OctalUartChannel::setBreak(bool on) {
  if (on) talk();
  isBreaking_ = on;
  command(on ? kCrStartBreak : kCrStopBreak);
  tryTurn();
}

std::chrono::nanoseconds OctalUartChannel::timeToSend() {
  if (!isOpen_) return byteTime_;
  if (isAllOut() && !isTalking_) return {};
  return static_cast<std::int64_t>(unsent_.size() + 1) * byteTime_;
}

void OctalUartChannel::talk() {
  if (!isRs485_ || std::exchange(isTalking_, true)) return;
  command(kCrAssertRts | kCrDisableRx);
}

void OctalUartChannel::tryTurn() {
  if (!waitsForTurn() || !isAllOut()) return;
  isTalking_ = false;
  command(kCrNegateRts | kCrEnableRx);
}

void OctalUartChannel::ring() const noexcept { ::eventfd_write(bell_.get(), 1); }

}  // namespace mpf
