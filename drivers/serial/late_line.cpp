// SPDX-License-Identifier: MIT
#include "drivers/serial/late_line.h"

#include <exception>
#include <utility>

namespace mpf {

LateLine::LateLine(std::string description, Make make)
    : description_(std::move(description)), make_(std::move(make)) {}

SerialLine::OpenState LateLine::tryOpen() {
  if (!line_) {
    try {
      line_ = make_();
    } catch (const std::exception& error) {
      problem_ = error.what();
      return OpenState::failed;
    }
  }
  return line_->tryOpen();
}

std::chrono::milliseconds LateLine::openTimeout() const {
  return line_ ? line_->openTimeout() : std::chrono::milliseconds{};
}

void LateLine::close() noexcept {
  if (line_) line_->close();
}

pollfd LateLine::waitsFor() const noexcept { return line_ ? line_->waitsFor() : pollfd{-1, 0, 0}; }

bool LateLine::tryRead(std::vector<LineByte>& bytes) { return line_ && line_->tryRead(bytes); }

std::optional<std::size_t> LateLine::tryWrite(std::span<const std::uint8_t> bytes) {
  return line_ ? line_->tryWrite(bytes) : std::nullopt;
}

std::chrono::milliseconds LateLine::timeToSend() const {
  return line_ ? line_->timeToSend() : std::chrono::milliseconds{};
}

void LateLine::discardUnsent() noexcept {
  if (line_) line_->discardUnsent();
}

std::uint64_t LateLine::takeOverruns() noexcept { return line_ ? line_->takeOverruns() : 0; }

std::string LateLine::tryConfigure(const SerialSettings& settings) {
  return line_ ? line_->tryConfigure(settings) : problem_;
}

bool LateLine::trySetBreak(bool on) noexcept { return line_ && line_->trySetBreak(on); }

}  // namespace mpf
