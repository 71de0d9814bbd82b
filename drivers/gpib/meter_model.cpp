// SPDX-License-Identifier: MIT
#include "drivers/gpib/meter_model.h"

#include <array>
#include <cctype>
#include <fmt/format.h>
#include <utility>

#include <mpf/drivers/gpib/gpib_types.h>

#include "base/number.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxCommand = 255;  // bytes of the instrument's input buffer
constexpr std::string_view kEndOfAnswer = "\r\n";

// Upper case, with single spaces between words and none around them.
std::string normalized(std::string_view text) {
  std::string result;
  for (const char raw : text) {
    const auto byte = static_cast<unsigned char>(raw);
    if (std::isspace(byte) == 0) {
      result.push_back(static_cast<char>(std::toupper(byte)));
    } else if (!result.empty() && result.back() != ' ') {
      result.push_back(' ');
    }
  }
  if (result.ends_with(' ')) result.pop_back();
  return result;
}

}  // namespace

MeterModel::Volts MeterModel::manualReadings() {
  return [next = std::size_t{0}]() mutable {
    constexpr std::array kReadings{-8.874270409E-01, -9.341735006E-01, -9.575970835E-01,
                                   -1.004537279E+00, -1.027972941E+00, -1.051432207E+00};
    return kReadings.at(next++ % kReadings.size());
  };
}

MeterModel::MeterModel(Volts volts, bool sendsEnd)
    : volts_(std::move(volts)), sendsEndAtPowerUp_(sendsEnd), sendsEnd_(sendsEnd) {}

bool MeterModel::receive(std::uint8_t byte, bool end) {
  const bool isSeparator = byte == '\n' || byte == ';';
  if (!isSeparator && command_.size() < kMaxCommand) command_.push_back(static_cast<char>(byte));
  if (!isSeparator && !end) return true;
  const auto command = normalized(std::exchange(command_, {}));
  if (!command.empty()) execute(command);
  return true;
}

std::optional<GpibInstrumentModel::Byte> MeterModel::nextByte() {
  if (answer_.empty() && trigger_ == Trigger::automatic) measure();
  if (answer_.empty()) return std::nullopt;
  hasReading_ = false;
  const Byte byte{static_cast<std::uint8_t>(answer_.front()), sendsEnd_ && answer_.size() == 1};
  answer_.erase(0, 1);
  return byte;
}

std::uint8_t MeterModel::serialPoll() {
  const auto result = status();
  isRequesting_ = false;
  return result;
}

void MeterModel::clear() {
  command_.clear();
  answer_.clear();
  hasError_ = hasServiceCommand_ = hasReading_ = isRequesting_ = false;
}

void MeterModel::trigger() { measure(); }

void MeterModel::execute(std::string_view command) {
  answer_.clear();
  hasReading_ = false;
  const auto space = command.find(' ');
  const auto verb = command.substr(0, space);
  const auto argument = space == std::string_view::npos ? "" : command.substr(space + 1);
  const bool hadCause = hasCause();
  if (verb == "ID?") return answer("HP3458A");
  if (verb == "STB?") return answer(fmt::format("{}", status()));
  if (verb == "ERRSTR?") {
    const bool hadError = std::exchange(hasError_, false);
    return answer(hadError ? R"(104,"SYNTAX ERROR")" : R"(0,"NO ERROR")");
  }
  if (verb == "END") return setEnd(argument);
  if (verb == "TRIG") return setTrigger(argument);
  if (verb == "RQS") return setRequestMask(argument);
  if (verb == "RESET") return reset();
  if (verb == "CSB") {
    hasServiceCommand_ = isRequesting_ = false;
    return;
  }
  if (verb != "SRQ") return fail();
  hasServiceCommand_ = true;
  requestService(hadCause);
}

void MeterModel::setEnd(std::string_view argument) {
  if (argument == "OFF" || argument == "0") {
    sendsEnd_ = false;
  } else if (argument == "ON" || argument == "1" || argument == "ALWAYS" || argument == "2") {
    sendsEnd_ = true;
  } else {
    fail();
  }
}

void MeterModel::setTrigger(std::string_view argument) {
  if (argument == "AUTO") {
    trigger_ = Trigger::automatic;
  } else if (argument == "HOLD" || argument == "SGL") {
    trigger_ = Trigger::hold;
    if (argument == "SGL") measure();
  } else {
    fail();
  }
}

void MeterModel::setRequestMask(std::string_view argument) {
  const bool hadCause = hasCause();
  const auto mask = tryNumber<std::uint8_t>(argument);
  if (!mask) return fail();
  requestMask_ = *mask;
  requestService(hadCause);
}

void MeterModel::answer(std::string text) { answer_ = std::move(text.append(kEndOfAnswer)); }

void MeterModel::fail() {
  const bool hadCause = hasCause();
  hasError_ = true;
  requestService(hadCause);
}

void MeterModel::measure() {
  const bool hadCause = hasCause();
  answer(fmt::format("{: .9E}", volts_()));
  hasReading_ = true;
  requestService(hadCause);
}

void MeterModel::reset() {
  clear();
  trigger_ = Trigger::automatic;
  sendsEnd_ = sendsEndAtPowerUp_;
  requestMask_ = 0;
}

std::uint8_t MeterModel::status() const {
  std::uint8_t bits = kReady;
  if (hasServiceCommand_) bits |= kServiceCommand;
  if (hasError_) bits |= kError;
  if (hasReading_) bits |= kDataAvailable;
  if (isRequesting_) bits |= kGpibRequestsService;
  return bits;
}

bool MeterModel::hasCause() const { return (status() & requestMask_ & ~kReady) != 0; }

// Requests service when a cause has appeared; one that was there before has had its request.
void MeterModel::requestService(bool hadCause) {
  if (!hadCause && hasCause()) isRequesting_ = true;
}

}  // namespace mpf
