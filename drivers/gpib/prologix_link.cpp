// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_link.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "base/printable.h"
#include "drivers/gpib/prologix_commands.h"

namespace mpf {
namespace {

constexpr std::uint8_t kFirstMark = 128;
constexpr std::size_t kMostShown = 80;  // bytes of a foreign answer in a message

// The empty lines end a line that was cut, also right after an escape.
constexpr std::string_view kSetUp =
    "\n\n++savecfg 0\n++mode 1\n++auto 0\n++eos 3\n++eot_enable 1\n";

std::string beginOf(std::uint8_t mark) { return fmt::format("++eot_char {}\n", mark); }
constexpr std::string_view kAskForEnd = "++ver\n++eot_char\n";

}  // namespace

void PrologixLink::Collector::expect(std::string end, std::chrono::milliseconds silence) {
  expectedEnd_ = std::move(end);
  silenceNs_ = Nanoseconds(silence).count() / 2;
  answer_.clear();
  silenceBefore_.reset();
}

ByteHandlerResult PrologixLink::Collector::readBegins() {
  isReading_ = true;
  bytes_.clear();
  lastNs_ = Clock::nowNs();
  return ByteHandlerResult::ok;
}

ByteHandlerResult PrologixLink::Collector::byteReceived(std::uint8_t byte) {
  if (!isReading_) return ByteHandlerResult::ok;
  const auto now = Clock::nowNs();
  if (silenceNs_ > 0 && now - lastNs_ > silenceNs_) silenceBefore_ = bytes_.size();
  lastNs_ = now;
  bytes_ += static_cast<char>(byte);
  if (byte == '\n' && bytes_.ends_with(expectedEnd_)) return ByteHandlerResult::endRead;
  return bytes_.size() < kMostBytes ? ByteHandlerResult::ok : ByteHandlerResult::error;
}

void PrologixLink::Collector::readEnds(SerialPortStatus /*status*/) {
  isReading_ = false;
  answer_ = std::exchange(bytes_, {});
}

PrologixLink::PrologixLink(std::string description, OpenPort openPort,
                           std::chrono::milliseconds patience)
    : description_(std::move(description)),
      openPort_(std::move(openPort)),
      patience_(patience),
      mark_(static_cast<std::uint8_t>(kFirstMark | (Clock::nowNs() >> 10))) {
  open();
}

void PrologixLink::open() {
  binding_.reset();
  port_.reset();  // before the new one: the controller accepts one connection
  port_ = openPort_();
  binding_.emplace(*port_, collector_);
  becomeUnknown();
}

// A thread or a descriptor may be lacking for the new port; then the next operation tries again.
GpibResult PrologixLink::tryReopen() try {
  open();
  return {};
} catch (const std::exception& error) {
  return {GpibStatus::failure, fmt::format("{}: {}", description_, error.what())};
}

void PrologixLink::becomeUnknown() {
  state_ = State::unknown;
  reopenAt_ = Deadline::never();
}

PrologixLink::Answer PrologixLink::exchange(const Request& request) {
  Answer answer;
  if (request.deadline.hasPassed()) {
    answer.result = {GpibStatus::timeout, "the deadline had passed before the operation began"};
    return answer;
  }
  if (state_ == State::ready && wasLost()) becomeUnknown();
  if (state_ == State::unknown) {
    answer.result = identify(request.deadline);
    if (!answer.result.ok()) return answer;
  }
  answer.mark = nextMark(request.otherMarkThan);
  const auto end = fmt::format("{}\r\n{}\r\n", version_, answer.mark);
  collector_.expect(end, request.silence);
  const auto text = fmt::format("{}{}{}", beginOf(answer.mark), request.commands, kAskForEnd);
  answer.result = transact(text, request.deadline);
  auto bytes = collector_.answer();
  const auto endAt = answer.result.ok() ? bytes.size() - end.size() : bytes.rfind(prologix::kName);
  answer.isComplete = endAt < bytes.size() && end.starts_with(bytes.substr(endAt));
  if (answer.isComplete) bytes = bytes.substr(0, endAt);
  answer.endsWithSilence = collector_.hadSilenceBefore(bytes.size());
  answer.bytes.assign(bytes.begin(), bytes.end());
  return answer;
}

// Connects, sets the controller up and checks its version. A connection that is lost meanwhile does
// no harm: then it begins again.
GpibResult PrologixLink::identify(Deadline deadline) {
  if (!port_ || reopenAt_.hasPassed()) {
    if (auto result = tryReopen(); !result.ok()) return result;
  }
  if (reopenAt_.isNever()) reopenAt_ = Deadline::after(patience_);
  const auto limit = std::min(deadline, Deadline::after(patience_));
  const auto mark = nextMark({});
  const auto end = fmt::format("\r\n{}\r\n", mark);
  const auto text = fmt::format("{}{}++ver\n{}", kSetUp, beginOf(mark), kAskForEnd);
  GpibResult result;
  do {
    if (result = connect(limit); !result.ok()) return result;
    unplugs_ = port_->counters().unplugs;
    collector_.expect(end, {});
    result = transact(text, limit);
  } while (result.status == GpibStatus::failure && !limit.hasPassed());
  if (result.status == GpibStatus::timeout)
    return explainMissingVersion(deadline.hasPassed() ? GpibStatus::timeout : GpibStatus::failure);
  return result.ok() ? takeVersion(end) : result;
}

// The version comes twice, so that a damaged one is not taken for the version.
GpibResult PrologixLink::takeVersion(std::string_view end) {
  auto text = collector_.answer();
  text.remove_suffix(end.size());
  const auto name = text.rfind(prologix::kName);
  if (name == std::string_view::npos) return explainMissingVersion(GpibStatus::failure);
  const auto version = text.substr(name);
  if (!text.substr(0, name).ends_with(fmt::format("{}\r\n", version)))
    return explainMissingVersion(GpibStatus::failure);
  version_ = version;
  state_ = State::ready;
  return {};
}

GpibResult PrologixLink::connect(Deadline deadline) {
  if (port_->waitForState(SerialPortState::plugged, deadline)) return {};
  return {GpibStatus::failure,
          fmt::format("{}: no connection: {}; check its power, its address and the cable",
                      description_, port_->unpluggedBecause())};
}

GpibResult PrologixLink::transact(std::string_view text, Deadline deadline) {
  const std::span data(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  const auto status = port_->writeRead(data, deadline);
  if (status == SerialPortStatus::success && !wasLost()) return {};
  if (state_ == State::ready) becomeUnknown();
  if (status == SerialPortStatus::timeout)
    return {GpibStatus::timeout,
            fmt::format("{} did not finish before the deadline", description_)};
  const auto because = port_->unpluggedBecause();
  return {GpibStatus::failure,
          fmt::format("{}: {}; the next operation connects again", description_,
                      because.empty() ? "the connection was lost or damaged" : because)};
}

bool PrologixLink::wasLost() const { return port_->counters().unplugs != unplugs_; }

GpibResult PrologixLink::explainMissingVersion(GpibStatus status) const {
  if (!version_.empty())
    return {status,
            fmt::format("{} does not answer; it is still busy with an earlier operation, or "
                        "it has stopped: then switch it off and on",
                        description_)};
  const auto shown = collector_.answer().substr(0, kMostShown);
  if (shown.empty())
    return {status, fmt::format("{} does not answer to ++ver; check that it is a Prologix "
                                "controller, that no other program uses it, and that its bus is "
                                "not stuck",
                                description_)};
  return {status, fmt::format("{} answers \"{}\" to ++ver, which is not the version of a Prologix "
                              "controller; check the address",
                              description_, printable(shown))};
}

std::uint8_t PrologixLink::nextMark(std::optional<std::uint8_t> otherThan) {
  const auto advance = [this] { mark_ = static_cast<std::uint8_t>(kFirstMark | (mark_ + 1)); };
  advance();
  if (mark_ == otherThan) advance();
  return mark_;
}

}  // namespace mpf
