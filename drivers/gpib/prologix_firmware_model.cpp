// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_firmware_model.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <utility>

#include <mpf/clock.h>

#include "base/number.h"
#include "drivers/gpib/prologix_commands.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kLookEvery{1};  // at an instrument that is not ready
constexpr std::size_t kMostUnsent = 4096;
constexpr int kHighestPrimary = 30;
constexpr std::size_t kPlusSigns = 2;

constexpr std::string_view kUnrecognized = "Unrecognized command";

// Addresses in the form "22", "22 101"; empty if the first word is no primary address.
std::vector<GpibAddress> addressesIn(const std::vector<int>& words) {
  std::vector<GpibAddress> addresses;
  for (const int word : words) {
    if (word <= kHighestPrimary) {
      addresses.push_back({.primary = static_cast<std::uint8_t>(word)});
    } else if (!addresses.empty()) {
      addresses.back().secondary = static_cast<std::uint8_t>(word - prologix::kFirstSecondary);
    }
  }
  return addresses;
}

std::string_view endOfString(int eos) {
  constexpr std::array<std::string_view, 4> kEnds{"\r\n", "\r", "\n", ""};
  return kEnds.at(static_cast<std::size_t>(eos));
}

}  // namespace

std::optional<PrologixFirmwareModel::Lines::Line> PrologixFirmwareModel::Lines::add(char byte) {
  if (std::exchange(isEscaped_, false)) {
    text_ += byte;
  } else if (byte == prologix::kEscape) {
    isEscaped_ = true;
  } else if (byte != '\r' && byte != '\n') {
    if (byte == '+' && plusSigns_ == text_.size()) ++plusSigns_;
    text_ += byte;
  } else if (!text_.empty()) {
    return Line{std::exchange(text_, {}), std::exchange(plusSigns_, 0) >= kPlusSigns};
  }
  return std::nullopt;
}

void PrologixFirmwareModel::attach(const GpibAddress& address,
                                   std::shared_ptr<GpibInstrumentModel> instrument) {
  instruments_[address] = std::move(instrument);
}

void PrologixFirmwareModel::execute(const Lines::Line& line) {
  if (line.isCommand) return executeCommand(std::string_view(line.text).substr(kPlusSigns));
  transmit(line.text);
  if (auto_ != 0) receive(true, std::nullopt);
}

void PrologixFirmwareModel::executeCommand(std::string_view text) {
  const auto name = text.substr(0, text.find(' '));
  text.remove_prefix(name.size());
  Words words;
  bool isReadEoi = false;
  while (!text.empty()) {
    text.remove_prefix(1);
    const auto word = text.substr(0, text.find(' '));
    text.remove_prefix(word.size());
    isReadEoi |= name == "read" && word == "eoi";
    if (const auto number = tryNumber<int>(word)) words.push_back(*number);
  }
  if (name == "read")
    return receive(isReadEoi, words.empty() ? std::nullopt : std::optional(words.front()));
  if (name == "ver") return answer(version);
  if (auto* const value = setting(name)) {
    if (words.empty()) return answer(std::to_string(*value));
    *value = words.front();
    return;
  }
  const auto known = command(name);
  if (known == nullptr) return answer(kUnrecognized);
  (this->*known)(words);
}

int* PrologixFirmwareModel::setting(std::string_view name) {
  if (name == "ren" && !hasRemoteEnable) return nullptr;
  const std::array<std::pair<std::string_view, int*>, 9> settings{
      {{"auto", &auto_},
       {"eoi", &eoi_},
       {"eos", &eos_},
       {"eot_char", &eotChar_},
       {"eot_enable", &eotEnable_},
       {"mode", &mode_},
       {"read_tmo_ms", &readTimeoutMs_},
       {"ren", &remoteEnable_},
       {"savecfg", &saveConfiguration_}}};
  const auto* const found =
      std::ranges::find(settings, name, &decltype(settings)::value_type::first);
  return found == settings.end() ? nullptr : found->second;
}

PrologixFirmwareModel::Command PrologixFirmwareModel::command(std::string_view name) const {
  using Self = PrologixFirmwareModel;
  static constexpr std::array<std::pair<std::string_view, Command>, 8> kCommands{
      {{"addr", &Self::address},
       {"clr", &Self::clear},
       {"ifc", &Self::ignore},
       {"llo", &Self::lockOut},
       {"loc", &Self::local},
       {"spoll", &Self::poll},
       {"srq", &Self::reportService},
       {"trg", &Self::trigger}}};
  const auto* const found =
      std::ranges::find(kCommands, name, &decltype(kCommands)::value_type::first);
  return found == kCommands.end() ? nullptr : found->second;
}

GpibInstrumentModel* PrologixFirmwareModel::at(const GpibAddress& address) const {
  const auto found = instruments_.find(address);
  return found == instruments_.end() ? nullptr : found->second.get();
}

void PrologixFirmwareModel::transmit(std::string_view data) {
  auto* const instrument = at(address_);
  if (instrument == nullptr) return;
  instrument->setControl(GpibInstrumentModel::Control::remote);
  const auto message = fmt::format("{}{}", data, endOfString(eos_));
  for (std::size_t i = 0; i < message.size(); ++i) {
    const bool end = eoi_ != 0 && i + 1 == message.size();
    const auto giveUp = Deadline::after(std::chrono::milliseconds(readTimeoutMs_));
    while (!instrument->receive(static_cast<std::uint8_t>(message[i]), end)) {
      if (giveUp.hasPassed() || !surroundings_.pause(kLookEvery)) return;
    }
  }
}

void PrologixFirmwareModel::receive(bool untilEnd, std::optional<int> untilByte) {
  auto* const instrument = at(address_);
  std::string unsent;
  const auto silence = std::chrono::milliseconds(readTimeoutMs_);
  auto giveUp = Deadline::after(silence);
  for (;;) {
    const auto byte = instrument == nullptr ? std::nullopt : instrument->nextByte();
    if (!byte || unsent.size() >= kMostUnsent) surroundings_.send(std::exchange(unsent, {}));
    if (!byte) {
      if (giveUp.hasPassed()) return;
      if (!surroundings_.pause(kLookEvery)) return;
      continue;
    }
    giveUp = Deadline::after(silence);
    unsent += static_cast<char>(byte->value);
    if (byte->end && eotEnable_ != 0) unsent += static_cast<char>(eotChar_);
    if ((byte->end && untilEnd) || byte->value == untilByte) break;
    if (unsent.size() >= kMostUnsent && !surroundings_.pause({})) return;
  }
  surroundings_.send(unsent);
}

void PrologixFirmwareModel::answer(std::string_view text) {
  surroundings_.send(fmt::format("{}\r\n", text));
}

void PrologixFirmwareModel::address(const Words& words) {
  if (words.empty()) return answer(prologix::addressText(address_));
  const auto addresses = addressesIn(words);
  if (addresses.empty()) return answer(kUnrecognized);
  address_ = addresses.front();
}

void PrologixFirmwareModel::clear(const Words& /*words*/) {
  if (auto* const instrument = at(address_)) instrument->clear();
}

void PrologixFirmwareModel::local(const Words& /*words*/) {
  if (auto* const instrument = at(address_))
    instrument->setControl(GpibInstrumentModel::Control::local);
}

void PrologixFirmwareModel::lockOut(const Words& /*words*/) {
  if (auto* const instrument = at(address_))
    instrument->setControl(GpibInstrumentModel::Control::remoteWithLockout);
}

void PrologixFirmwareModel::poll(const Words& words) {
  const auto addresses = words.empty() ? std::vector{address_} : addressesIn(words);
  if (addresses.empty()) return answer(kUnrecognized);
  auto* const instrument = at(addresses.front());
  if (instrument != nullptr) return answer(std::to_string(instrument->serialPoll()));
  const auto giveUp = Deadline::after(std::chrono::milliseconds(readTimeoutMs_));
  while (!giveUp.hasPassed() && surroundings_.pause(kLookEvery)) continue;
}

void PrologixFirmwareModel::reportService(const Words& /*words*/) {
  const bool isActive = std::ranges::any_of(
      instruments_, [](const auto& entry) { return entry.second->requestsService(); });
  answer(isActive ? "1" : "0");
}

void PrologixFirmwareModel::trigger(const Words& words) {
  const auto addresses = words.empty() ? std::vector{address_} : addressesIn(words);
  for (const auto& address : addresses) {
    if (auto* const instrument = at(address)) instrument->trigger();
  }
}

}  // namespace mpf
