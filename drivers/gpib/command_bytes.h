// SPDX-License-Identifier: MIT
// The bytes that a controller sends with ATN.
//
// Source  IEEE 488.1, table "Remote message coding".
#pragma once

#include <cstdint>

namespace mpf::gpib_command {

enum Command : std::uint8_t {
  // addressed: to the listeners
  kGoToLocal = 0x01,  // GTL
  kSelectedDeviceClear = 0x04,  // SDC
  kGroupExecuteTrigger = 0x08,  // GET
  // universal: to all instruments
  kLocalLockout = 0x11,  // LLO
  kDeviceClear = 0x14,  // DCL
  kSerialPollEnable = 0x18,  // SPE
  kSerialPollDisable = 0x19,  // SPD
  // addresses; the address is added
  kListen = 0x20,  // LAG
  kUnlisten = 0x3f,  // UNL
  kTalk = 0x40,  // TAG
  kUntalk = 0x5f,  // UNT
  kSecondary = 0x60,  // SCG
};

}  // namespace mpf::gpib_command
