// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_model_channel.h"

#include <algorithm>
#include <utility>

#include "drivers/octal_uart/scc2698b.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;

std::uint8_t statusOf(LineFault fault) {
  switch (fault) {
    case LineFault::none:
    case LineFault::overrun:  // set by arrive()
    case LineFault::unplugged:
      return 0;
    case LineFault::parity:
      return kSrParity;
    case LineFault::framing:
      return kSrFraming;
    case LineFault::breakSignal:
      return kSrBreak;
  }
  return 0;
}

}  // namespace

// ---- registers

std::uint8_t OctalUartModelChannel::readMr() {
  return std::exchange(pointsToMr2_, true) ? mode_.mr2 : mode_.mr1;
}

void OctalUartModelChannel::writeMr(std::uint8_t value) {
  (std::exchange(pointsToMr2_, true) ? mode_.mr2 : mode_.mr1) = value;
}

std::uint8_t OctalUartModelChannel::readSr() const {
  unsigned sr = 0;
  if (!fifo_.empty()) sr |= kSrRxRdy | fifo_.front().status;
  if (fifo_.size() == kFifoBytes) sr |= kSrFfull;
  if (hasOverrun_) sr |= kSrOverrun;
  if (isTxEnabled_ && !thr_) sr |= kSrTxRdy;
  if (isTxEnabled_ && !thr_ && !txShift_) sr |= kSrTxEmt;
  return static_cast<std::uint8_t>(sr);
}

std::uint8_t OctalUartModelChannel::readRhr() {
  if (fifo_.empty()) return 0;
  const auto byte = fifo_.front();
  fifo_.pop_front();
  fillFifo();
  return byte.value;
}

void OctalUartModelChannel::writeThr(std::uint8_t value) {
  if (isTxEnabled_ && !thr_) thr_ = value;
}

std::uint8_t OctalUartModelChannel::isr() const {
  unsigned isr = 0;
  if (isTxEnabled_ && !thr_) isr |= kIsrTxRdy;
  if ((mode_.mr1 & kMr1RxIntFull) != 0 ? fifo_.size() == kFifoBytes : !fifo_.empty())
    isr |= kIsrRxRdy;
  if (hasBreakChanged_) isr |= kIsrBreakChange;
  return static_cast<std::uint8_t>(isr);
}

void OctalUartModelChannel::writeCr(std::uint8_t value) {
  switch (value & 0xf0) {
    case kCrResetMr:
      pointsToMr2_ = false;
      break;
    case kCrResetRx:
      isRxEnabled_ = false;
      fifo_.clear();
      rxShift_.reset();
      break;
    case kCrResetTx:
      isTxEnabled_ = false;
      thr_.reset();
      txShift_.reset();
      break;
    case kCrResetErrors:  // also resets the errors of the byte that is read next
      hasOverrun_ = false;
      if (!fifo_.empty()) fifo_.front().status = 0;
      break;
    case kCrResetBreakChange:
      hasBreakChanged_ = false;
      break;
    case kCrStartBreak:
    case kCrStopBreak:
      setBreak((value & 0xf0) == kCrStartBreak);
      break;
    case kCrAssertRts:
    case kCrNegateRts:
      rts_ = (value & 0xf0) == kCrAssertRts;
      break;
    default:
      break;
  }
  // The data sheet forbids to reset and enable the same direction in one write; here the reset has
  // precedence.
  if ((value & kCrEnableRx) != 0 && (value & 0xf0) != kCrResetRx) isRxEnabled_ = true;
  if ((value & kCrDisableRx) != 0) isRxEnabled_ = false;
  if ((value & kCrEnableTx) != 0 && (value & 0xf0) != kCrResetTx) isTxEnabled_ = true;
  if ((value & kCrDisableTx) != 0) isTxEnabled_ = false;
}

void OctalUartModelChannel::setBreak(bool on) {
  if (!isTxEnabled_ && on) return;
  if (std::exchange(isBreaking_, on) || !on) return;
  ++breaks_;
  if (isLooped()) arrive({0, LineFault::breakSignal});
}

// ---- line

bool OctalUartModelChannel::isLooped() const { return (mode_.mr2 & kMr2Mode) == kMr2LocalLoopback; }

bool OctalUartModelChannel::requestsToSend() const {
  return rts_ && ((mode_.mr1 & kMr1RxRts) == 0 || fifo_.size() < kFifoBytes);
}

bool OctalUartModelChannel::maySend() const {
  return !isBreaking_ && (clearToSend_ || (mode_.mr2 & kMr2TxCts) == 0);
}

void OctalUartModelChannel::fillFifo() {
  if (fifo_.size() == kFifoBytes || !rxShift_) return;
  fifo_.push_back(*rxShift_);
  rxShift_.reset();
}

void OctalUartModelChannel::arrive(LineByte byte) {
  if (!isRxEnabled_ && !isLooped()) {
    ++unheard_;
    return;
  }
  const auto bits = 5 + (mode_.mr1 & kMr1Bits);
  const Received received{static_cast<std::uint8_t>(byte.value & ((1U << bits) - 1)),
                          statusOf(byte.fault)};
  if (byte.fault == LineFault::breakSignal) hasBreakChanged_ = true;
  if (rxShift_) {  // overwritten; the bytes of the FIFO stay
    hasOverrun_ = true;
    ++overrun_;
  }
  rxShift_ = received;
  fillFifo();
}

// ---- time

std::int64_t OctalUartModelChannel::byteNs() const { return byteTime(settings()).count(); }

void OctalUartModelChannel::start(std::int64_t nowNs) {
  if (txShift_ || !thr_ || !maySend()) return;
  txShift_ = std::exchange(thr_, std::nullopt);
  sentAtNs_ = nowNs + byteNs();
}

void OctalUartModelChannel::finish() {
  const auto value = txShift_.value_or(0);
  txShift_.reset();
  if (isLooped()) return arrive({value, LineFault::none});
  const auto bits = 5 + (mode_.mr1 & kMr1Bits);
  outgoing += static_cast<char>(value & ((1U << bits) - 1));
}

void OctalUartModelChannel::runInstantly() {
  while (thr_ && maySend()) {
    start(0);
    finish();
  }
  // A byte for a disabled receiver is lost at once; other bytes wait until the FIFO has room.
  while (!incoming.empty() && (!isRxEnabled_ || fifo_.size() < kFifoBytes)) {
    arrive(incoming.front());
    incoming.pop_front();
  }
}

void OctalUartModelChannel::runUntil(std::int64_t nowNs, bool takesTime, bool mayLag) {
  if (!takesTime) return runInstantly();
  const auto follow = [&](std::int64_t atNs) {
    return mayLag ? std::max(atNs, nowNs - byteNs()) : atNs;
  };
  start(nowNs);
  while (txShift_ && sentAtNs_ <= nowNs) {
    finish();
    start(follow(sentAtNs_));
  }
  const bool held = (mode_.mr1 & kMr1RxRts) != 0 && !requestsToSend();
  if (incoming.empty() || held) return arrivesAtNs_.reset();
  if (!arrivesAtNs_) arrivesAtNs_ = nowNs + byteNs();
  while (!incoming.empty() && *arrivesAtNs_ <= nowNs) {
    arrive(incoming.front());
    incoming.pop_front();
    arrivesAtNs_ = follow(*arrivesAtNs_) + byteNs();
  }
  if (incoming.empty()) arrivesAtNs_.reset();
}

std::int64_t OctalUartModelChannel::nextEventNs() const {
  auto next = INT64_MAX;
  if (txShift_) next = sentAtNs_;
  if (arrivesAtNs_) next = std::min(next, *arrivesAtNs_);
  return next;
}

}  // namespace mpf
