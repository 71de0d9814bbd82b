// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_reader.h"

#include <algorithm>
#include <utility>

#include "server/programs/serial_server/line_faults.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kCheckEvery{20};

}  // namespace

LineReader::LineReader(std::size_t bufferBytes, std::string eom, bool circular,
                       const LineLimits& limits, SurplusHandler onSurplus,
                       std::function<void()> onFault)
    : onFault_(std::move(onFault)),
      bufferBytes_(bufferBytes),
      eom_(std::move(eom)),
      circular_(circular),
      onSurplus_(std::move(onSurplus)),
      sync_(limits) {}

void LineReader::setEom(std::string eom) {
  const std::lock_guard lock(mutex_);
  eom_ = std::move(eom);
}

void LineReader::setCircular(bool circular) {
  const std::lock_guard lock(mutex_);
  circular_ = circular;
}

// ---- the server's thread

void LineReader::prepareRead(bool flush, std::size_t maxBytes, bool mayBeLate) {
  const std::lock_guard lock(mutex_);
  dropLateAnswer();
  isQuestion_ = false;
  mayBeLate_ = mayBeLate;
  flush_ = flush;
  maxBytes_ = maxBytes;
  answer_ = {};
}

void LineReader::prepareQuestion(std::size_t maxBytes, bool mayBeLate) {
  const std::lock_guard lock(mutex_);
  dropLateAnswer();
  isQuestion_ = true;
  mayBeLate_ = mayBeLate;
  maxBytes_ = maxBytes;
  answer_ = {};
}

bool LineReader::tryContinue(bool mayBeLate) {
  const std::lock_guard lock(mutex_);
  continues_ = phase_ == Phase::collectingLate;
  mayBeLate_ = mayBeLate;
  return continues_;
}

LineReader::Sync LineReader::waitUntilSynchronized(bool isQuestion, Deadline until,
                                                   const std::function<bool()>& isAbandoned) {
  std::unique_lock lock(mutex_);
  dropLateAnswer();
  phase_ = isQuestion ? Phase::syncing : Phase::idle;
  if (isQuestion && !std::exchange(input_, {}).empty()) noteSurplus();
  for (;;) {
    const auto readyAt = Deadline::atNs(sync_.readyAtNs(isQuestion));
    if (readyAt.hasPassed()) return Sync::synchronized;
    const bool isLate = until.hasPassed();
    lock.unlock();
    const bool isOver = isLate || isAbandoned();
    lock.lock();
    if (isOver) {
      phase_ = Phase::idle;
      return isLate ? Sync::noSilence : Sync::abandoned;
    }
    answerSeen_.wait_for(lock, std::min({readyAt, until, Deadline::after(kCheckEvery)}).left());
  }
}

void LineReader::noteWritten() {
  const std::lock_guard lock(mutex_);
  sync_.written(Clock::nowNs());
}

// The reply with status "timeout" contained the bytes that had been received until then. Those that
// followed belong to the answer of a write-read, but to the circular buffer after a read.
void LineReader::dropLateAnswer() {
  continues_ = false;
  if (phase_ != Phase::collectingLate) return;
  phase_ = Phase::idle;
  if (isQuestion_) input_.clear();
  else input_.eraseFirst(returnedBytes_);
}

LineReader::Answer LineReader::takeAnswer() {
  const std::lock_guard lock(mutex_);
  if (phase_ == Phase::syncing) phase_ = Phase::idle;  // the port has not begun to read
  return std::exchange(answer_, {});
}

// ---- the port's thread

std::size_t LineReader::completeBytes() const {
  const bool isLimited = maxBytes_ != 0 && input_.size() >= maxBytes_;
  const auto bytes = input_.first(isLimited ? maxBytes_ : input_.size());
  const auto end = eom_.empty() ? std::string::npos : bytes.find(eom_);
  if (end != std::string::npos) return end + eom_.size();
  return isLimited ? maxBytes_ : 0;
}

bool LineReader::endsAnswer() const {
  return (!eom_.empty() && input_.endsWith(eom_)) || (maxBytes_ != 0 && input_.size() >= maxBytes_);
}

ByteHandlerResult LineReader::byteReceived(std::uint8_t byte) {
  const std::lock_guard lock(mutex_);
  const bool wasWhole = sync_.isWhole();
  sync_.received(byte, Clock::nowNs());
  if (!wasWhole && sync_.isWhole()) answerSeen_.notify_one();
  switch (phase_) {
    case Phase::idle:
      if (circular_) return collect(byte);
      noteSurplus();
      return ByteHandlerResult::ok;
    case Phase::syncing:
      noteSurplus();
      return ByteHandlerResult::ok;
    case Phase::armed:
      noteSurplus();
      answer_.wasDisturbed = true;
      return ByteHandlerResult::error;
    case Phase::reading:
    case Phase::collectingLate:
      return collect(byte);
  }
  return ByteHandlerResult::ok;
}

ByteHandlerResult LineReader::collect(std::uint8_t byte) {
  const bool isRead = phase_ == Phase::reading;
  if (input_.size() >= bufferBytes_) {
    if (isRead) {
      answer_.overflow = true;
      // The byte follows the answer: the next answer begins with it.
      input_.push_back(static_cast<char>(byte));
      return ByteHandlerResult::endRead;
    }
    if (phase_ == Phase::collectingLate && isQuestion_) {
      dropLateAnswer();
      return circular_ ? collect(byte) : ByteHandlerResult::ok;
    }
    dropOldestByte();
  }
  input_.push_back(static_cast<char>(byte));
  return isRead && endsAnswer() ? ByteHandlerResult::endRead : ByteHandlerResult::ok;
}

// In the circular buffer, or of the late answer to a read, which then ends as one that is too long.
void LineReader::dropOldestByte() {
  input_.eraseFirst(1);
  if (phase_ != Phase::collectingLate) return;
  answer_.overflow = true;
  if (returnedBytes_ > 0) --returnedBytes_;
}

void LineReader::noteSurplus() {
  if (sync_.isSurplusExpected()) return;
  sync_.noteSurplus();
  if (!std::exchange(isSurplusReported_, true) && onSurplus_) onSurplus_();
}

ByteHandlerResult LineReader::readBegins() {
  const std::lock_guard lock(mutex_);
  if (isQuestion_ && !continues_) {
    if (!std::exchange(input_, {}).empty()) noteSurplus();
    // The port has passed on all bytes that had arrived; some may have arrived after
    // waitUntilSynchronized() saw the silence.
    answer_.wasDisturbed = !Deadline::atNs(sync_.readyAtNs(true)).hasPassed();
    phase_ = answer_.wasDisturbed ? Phase::idle : Phase::armed;
    return answer_.wasDisturbed ? ByteHandlerResult::error : ByteHandlerResult::ok;
  }
  phase_ = Phase::reading;
  if (!continues_ && (flush_ || !circular_)) input_.clear();
  const bool isOver = answer_.overflow || completeBytes() != 0;
  return isOver ? ByteHandlerResult::endRead : ByteHandlerResult::ok;
}

void LineReader::sendBegins() {
  const std::lock_guard lock(mutex_);
  phase_ = Phase::reading;
  isSurplusReported_ = false;
  sync_.asked(eom_, maxBytes_);
}

void LineReader::readEnds(SerialPortStatus status) {
  const std::lock_guard lock(mutex_);
  const bool wasSent = phase_ == Phase::reading && isQuestion_;
  if (phase_ == Phase::armed && status == SerialPortStatus::failure) answer_.wasDisturbed = true;
  phase_ = Phase::idle;
  continues_ = false;
  const auto complete = completeBytes();
  auto bytes = complete != 0 ? complete : input_.size();
  if (answer_.overflow) bytes = std::min(bytes, bufferBytes_);
  answer_.bytes = input_.first(bytes);
  answer_.faults = static_cast<std::uint8_t>(answer_.faults | input_.faultsOfFirst(bytes));
  if (wasSent && complete != 0 && status == SerialPortStatus::success && answer_.faults == 0) {
    sync_.answered();
  } else if (wasSent) {
    sync_.unanswered(Clock::nowNs());
  }
  // What follows an answer whose end cannot be recognised may be anything; a read without an end
  // has all bytes until its last attempt ends.
  const bool hasEnd = !eom_.empty() || maxBytes_ != 0;
  const bool isKept = isQuestion_ ? wasSent && hasEnd : true;
  if (mayBeLate_ && status == SerialPortStatus::timeout && isKept) {
    phase_ = Phase::collectingLate;
    returnedBytes_ = bytes;
  } else {
    input_.eraseFirst(bytes);
  }
}

void LineReader::lineFailed(LineFault fault, std::uint64_t /*count*/) {
  {
    const std::lock_guard lock(mutex_);
    // A lost line damages only an answer that was incomplete.
    const bool isBetweenAnswers = input_.empty() || (!eom_.empty() && input_.endsWith(eom_));
    const bool cuts = fault != LineFault::unplugged || !isBetweenAnswers;
    const bool isKept = phase_ == Phase::reading || phase_ == Phase::collectingLate ||
                        (phase_ == Phase::idle && circular_);
    if (cuts && isKept) input_.mark(faultBit(fault));
    if (phase_ == Phase::reading)
      answer_.faults = static_cast<std::uint8_t>(answer_.faults | faultBit(fault));
    if (fault != LineFault::unplugged) sync_.disturbed(Clock::nowNs());
  }
  if (onFault_) onFault_();
}

}  // namespace mpf
