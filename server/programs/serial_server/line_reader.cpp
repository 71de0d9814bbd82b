// SPDX-License-Identifier: MIT
#include <mpf/server/programs/serial_server/line_reader.h>

#include <algorithm>
#include <utility>

namespace mpf {

LineReader::LineReader(std::size_t bufferBytes, std::string eom, bool circular)
    : bufferBytes_(bufferBytes), eom_(std::move(eom)), circular_(circular) {}

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
  const auto bytes = complete != 0 ? complete : input_.size();
  answer_.bytes = input_.substr(0, bytes);
  input_.erase(0, bytes);
}

}  // namespace mpf
