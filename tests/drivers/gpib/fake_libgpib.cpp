// SPDX-License-Identifier: MIT
#include "tests/drivers/gpib/fake_libgpib.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>

#include "drivers/gpib/command_bytes.h"

namespace {

using mpf::GpibAddress;
using mpf::GpibInstrumentModel;
using Control = GpibInstrumentModel::Control;
namespace command = mpf::gpib_command;

constexpr int kOwnAddress = 3;  // not 0, which everyone expects
constexpr int kError = 1 << 15;
constexpr int kTimeout = 1 << 14;
constexpr int kEnd = 1 << 13;
constexpr int kNoListener = 2;
constexpr int kWrongAddress = 3;
constexpr int kAborted = 6;
constexpr std::chrono::milliseconds kLookEvery{1};

struct Fault {
  int error = 0;
  int count = 0;
  int calls = 0;
};

struct Board {
  std::map<GpibAddress, GpibInstrumentModel*> instruments;
  std::map<std::string, Fault> faults;
  std::vector<GpibAddress> listeners;
  std::optional<GpibAddress> talker;
  bool isPolling = false;
  bool seesLines = true;
  bool sendsEnd = true;
  int endOfString = 0;
  int interfaceClears = 0;
  std::chrono::milliseconds timeout{1000};
};

Board board;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables): as in the library
thread_local int lastError = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)
thread_local long lastCount = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

int fail(int error, long count) {
  lastError = error;
  lastCount = count;
  return kError | (error == kAborted ? kTimeout : 0);
}

int succeed(long count = 0, int bits = 0) {
  lastCount = count;
  return bits;
}

// The status of a fault that the test wants.
std::optional<int> faultOf(const char* function) {
  const auto found = board.faults.find(function);
  if (found == board.faults.end() || found->second.calls == 0) return std::nullopt;
  --found->second.calls;
  return fail(found->second.error, found->second.count);
}

GpibInstrumentModel* at(const GpibAddress& address) {
  const auto found = board.instruments.find(address);
  return found == board.instruments.end() ? nullptr : found->second;
}

template <class Act>
void forListeners(const Act& act) {
  for (const auto& address : board.listeners) {
    if (auto* const instrument = at(address)) act(*instrument);
  }
}

void executeUniversal(std::uint8_t byte) {
  if (byte == command::kSerialPollEnable) board.isPolling = true;
  if (byte == command::kSerialPollDisable) board.isPolling = false;
  for (const auto& [address, instrument] : board.instruments) {
    if (byte == command::kDeviceClear) instrument->clear();
    if (byte == command::kLocalLockout) instrument->setControl(Control::remoteWithLockout);
  }
}

void executeAddressed(std::uint8_t byte) {
  forListeners([byte](GpibInstrumentModel& instrument) {
    if (byte == command::kSelectedDeviceClear) instrument.clear();
    if (byte == command::kGroupExecuteTrigger) instrument.trigger();
    if (byte == command::kGoToLocal) instrument.setControl(Control::local);
  });
}

void execute(std::uint8_t byte, std::uint8_t previous) {
  const auto low = static_cast<std::uint8_t>(byte & 0x1f);
  if (byte == command::kUnlisten) return board.listeners.clear();
  if (byte == command::kUntalk) return board.talker.reset();
  if (byte < command::kLocalLockout) return executeAddressed(byte);
  if (byte < command::kListen) return executeUniversal(byte);
  if (byte < command::kTalk) return board.listeners.push_back({.primary = low});
  if (byte < command::kSecondary) {
    board.talker = GpibAddress{.primary = low};
  } else if (previous >= command::kTalk) {
    board.talker->secondary = low;
  } else {
    board.listeners.back().secondary = low;
  }
}

bool isBoard(const GpibAddress& address) { return address == GpibAddress{.primary = kOwnAddress}; }

}  // namespace

extern "C" {

void fakeGpibReset() { board = {}; }

void fakeGpibAttach(int primary, int secondary, GpibInstrumentModel* instrument) {
  GpibAddress address{.primary = static_cast<std::uint8_t>(primary)};
  if (secondary >= 0) address.secondary = static_cast<std::uint8_t>(secondary);
  board.instruments[address] = instrument;
}

void fakeGpibFail(const char* function, int error, int count, int calls) {
  board.faults[function] = {error, count, calls};
}

void fakeGpibMonitorLines(bool on) { board.seesLines = on; }

int fakeGpibInterfaceClears() { return board.interfaceClears; }

// ---- the functions of libgpib

// NOLINTBEGIN(readability-identifier-naming): the library's names
int ThreadIberr() { return lastError; }
long ThreadIbcntl() { return lastCount; }
// NOLINTEND(readability-identifier-naming)

int ibask(int /*ud*/, int /*option*/, int* value) {
  if (const auto status = faultOf("ibask")) return *status;
  *value = kOwnAddress;
  return succeed();
}

int ibtmo(int /*ud*/, int code) {
  constexpr int kFirst = 5;  // 1 ms, and then 3 ms, 10 ms, 30 ms ...
  int milliseconds = (code - kFirst) % 2 == 0 ? 1 : 3;
  for (int step = kFirst + 1; step < code; step += 2) milliseconds *= 10;
  if ((code - kFirst) % 2 != 0) milliseconds /= 10;
  board.timeout = std::chrono::milliseconds(milliseconds);
  return succeed();
}

int ibeos(int /*ud*/, int mode) {
  board.endOfString = mode;
  return succeed();
}

int ibeot(int /*ud*/, int on) {
  board.sendsEnd = on != 0;
  return succeed();
}

int ibsic(int /*ud*/) {
  if (const auto status = faultOf("ibsic")) return *status;
  ++board.interfaceClears;
  board.listeners.clear();
  board.talker.reset();
  board.isPolling = false;
  return succeed();
}

int ibsre(int /*ud*/, int on) {
  if (const auto status = faultOf("ibsre")) return *status;
  for (const auto& [address, instrument] : board.instruments)
    instrument->setControl(on != 0 ? Control::remote : Control::local);
  return succeed();
}

int iblines(int /*ud*/, short* lines) {
  constexpr short kKnown = 0x20;
  constexpr short kActive = 0x2000;
  const bool isActive = std::ranges::any_of(
      board.instruments, [](const auto& entry) { return entry.second->requestsService(); });
  *lines = static_cast<short>((board.seesLines ? kKnown : 0) | (isActive ? kActive : 0));
  return succeed();
}

int ibcmd(int /*ud*/, const void* bytes, long count) {
  if (const auto status = faultOf("ibcmd")) return *status;
  const auto* const commands = static_cast<const std::uint8_t*>(bytes);
  for (long i = 0; i < count; ++i) execute(commands[i], i > 0 ? commands[i - 1] : 0);
  return succeed(count);
}

int ibwrt(int /*ud*/, const void* bytes, long count) {
  if (const auto status = faultOf("ibwrt")) return *status;
  if (!board.talker || !isBoard(*board.talker)) return fail(kWrongAddress, 0);
  bool isHeard = false;
  forListeners([&](GpibInstrumentModel&) { isHeard = true; });
  if (!isHeard) return fail(kNoListener, 0);
  const auto giveUp = mpf::Deadline::after(board.timeout);
  for (long i = 0; i < count; ++i) {
    const bool end = board.sendsEnd && i + 1 == count;
    bool isAccepted = false;
    while (!isAccepted) {
      forListeners([&](GpibInstrumentModel& instrument) {
        isAccepted |= instrument.receive(static_cast<const std::uint8_t*>(bytes)[i], end);
      });
      if (!isAccepted && giveUp.hasPassed()) return fail(kAborted, i);
      if (!isAccepted) std::this_thread::sleep_for(kLookEvery);
    }
  }
  return succeed(count);
}

int ibrd(int /*ud*/, void* bytes, long count) {
  if (const auto status = faultOf("ibrd")) return *status;
  if (std::ranges::none_of(board.listeners, isBoard)) return fail(kWrongAddress, 0);
  auto* const instrument = board.talker ? at(*board.talker) : nullptr;
  auto* const buffer = static_cast<std::uint8_t*>(bytes);
  if (board.isPolling && instrument != nullptr) {
    buffer[0] = instrument->serialPoll();
    return succeed(1);
  }
  const bool stopsAtByte = (board.endOfString & 0x400) != 0;
  const auto giveUp = mpf::Deadline::after(board.timeout);
  for (long i = 0; i < count;) {
    const auto byte = instrument == nullptr ? std::nullopt : instrument->nextByte();
    if (byte) {
      buffer[i++] = byte->value;
      if (byte->end || (stopsAtByte && byte->value == (board.endOfString & 0xff)))
        return succeed(i, kEnd);
    } else if (giveUp.hasPassed()) {
      return fail(kAborted, i);
    } else {
      std::this_thread::sleep_for(kLookEvery);
    }
  }
  return succeed(count);
}

}  // extern "C"
