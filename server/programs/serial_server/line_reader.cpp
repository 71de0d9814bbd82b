// SPDX-License-Identifier: MIT
#include <mpf/server/programs/serial_server/line_reader.h>

#include <algorithm>
#include <utility>

#include <mpf/server/programs/serial_server/line_faults.h>

namespace mpf {

LineReader::LineReader(std::size_t bufferBytes, std::string eom, bool circular, std::function<void()> onFault)
    : onFault_(std::move(onFault)), bufferBytes_(bufferBytes), eom_(std::move(eom)), circular_(circular) {}

void LineReader::setEom(std::string eom) {
  const std::lock_guard lock(mutex_);
  eom_ = std::move(eom);
}

void LineReader::setCircular(bool circular) {
  const std::lock_guard lock(mutex_);
  circular_ = circular;
}

void LineReader::prepare(bool flush, std::size_t maxBytes) {
  const std::lock_guard lock(mutex_);
  flush_ = flush;
  maxBytes_ = maxBytes;
  answer_ = {};
}

LineReader::Answer LineReader::takeAnswer() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answer_, {});
}

std::size_t LineReader::completeBytes() const {
  if (maxBytes_ != 0 && input_.size() >= maxBytes_) {
    const auto end = eom_.empty() ? std::string::npos : input_.substr(0, maxBytes_).find(eom_);
    return end == std::string::npos ? maxBytes_ : end + eom_.size();
  }
  const auto end = eom_.empty() ? std::string::npos : input_.find(eom_);
  return end == std::string::npos ? 0 : end + eom_.size();
}

ByteHandlerResult LineReader::byteReceived(std::uint8_t byte) {
  const std::lock_guard lock(mutex_);
  if (!reading_ && !circular_) return ByteHandlerResult::ok;
  if (input_.size() >= bufferBytes_) {
    if (reading_) {
      answer_.overflow = true;
      input_.push_back(static_cast<char>(byte));  // behind what the answer has: the next one begins with it
      return ByteHandlerResult::endRead;
    }
    input_.erase(0, 1);  // circular: the oldest goes
  }
  input_.push_back(static_cast<char>(byte));
  return reading_ && completeBytes() != 0 ? ByteHandlerResult::endRead : ByteHandlerResult::ok;
}

ByteHandlerResult LineReader::readBegins() {
  const std::lock_guard lock(mutex_);
  reading_ = true;
  if (flush_ || !circular_) input_.clear();
  return completeBytes() != 0 ? ByteHandlerResult::endRead : ByteHandlerResult::ok;
}

void LineReader::readEnds(SerialPortStatus /*status*/) {
  const std::lock_guard lock(mutex_);
  reading_ = false;
  const auto complete = completeBytes();
  auto bytes = complete != 0 ? complete : input_.size();
  if (answer_.overflow) bytes = std::min(bytes, bufferBytes_);
  answer_.bytes = input_.substr(0, bytes);
  answer_.faults = static_cast<std::uint8_t>(answer_.faults | input_.faultsOfFirst(bytes));
  input_.erase(0, bytes);
}

void LineReader::lineFailed(LineFault fault, std::uint64_t /*count*/) {
  {
    const std::lock_guard lock(mutex_);
    // A line that was away has cut off only what had not come in full.
    const bool isBetweenAnswers = input_.empty() || (!eom_.empty() && input_.endsWith(eom_));
    const bool cuts = fault != LineFault::unplugged || !isBetweenAnswers;
    if (cuts && (reading_ || circular_)) input_.mark(faultBit(fault));
    if (reading_) answer_.faults = static_cast<std::uint8_t>(answer_.faults | faultBit(fault));
  }
  if (onFault_) onFault_();
}

}  // namespace mpf
