// SPDX-License-Identifier: MIT
// Registers of the Acromag IP330, with the names of its manual: byte offsets in the I/O space, and
// bits of the control register.
// Source   IP330 manual, "Memory map"; on the big-endian bus the prescaler is at 02 and the vector
//          at 03.
#pragma once

#include <cstddef>
#include <cstdint>

namespace mpf::ip330 {

inline constexpr std::size_t kControl = 0x00;          // 16 bits
inline constexpr std::size_t kTimerPrescaler = 0x02;   // 8
inline constexpr std::size_t kInterruptVector = 0x03;  // 8
inline constexpr std::size_t kConversionTimer = 0x04;  // 16
inline constexpr std::size_t kEndChannel = 0x06;       // 8
inline constexpr std::size_t kStartChannel = 0x07;     // 8
// 16, a bit for each mailbox 0 to 15, at 0x0a 16 to 31; a read clears it
inline constexpr std::size_t kNewData = 0x08;
// as kNewData: a mailbox was overwritten before it was read
inline constexpr std::size_t kMissedData = 0x0c;
inline constexpr std::size_t kStartConvert = 0x10;     // 16; writing bit 0 starts
inline constexpr std::size_t kGainSelect = 0x20;       // 8 bits for each of 32 channels, 0 to 3
inline constexpr std::size_t kMailBox = 0x40;          // 16 bits, 32 of them

inline constexpr std::uint16_t kStraightBinary = 0x0002;
inline constexpr std::uint16_t kTriggerOutput = 0x0004;
inline constexpr std::uint16_t kInputSource = 0x0038;  // mask of the sources below
inline constexpr std::uint16_t kSourceDifferential = 0x0000;
inline constexpr std::uint16_t kSourceSingleEnded = 0x0008;
inline constexpr std::uint16_t kSource4V9000 = 0x0018;  // calibration voltages
inline constexpr std::uint16_t kSource2V4500 = 0x0020;
inline constexpr std::uint16_t kSource1V2250 = 0x0028;
inline constexpr std::uint16_t kSource0V6125 = 0x0030;
inline constexpr std::uint16_t kSourceAutoZero = 0x0038;
inline constexpr std::uint16_t kScanMode = 0x0700;
inline constexpr unsigned kScanModeShift = 8;
inline constexpr std::uint16_t kTimerEnable = 0x0800;
inline constexpr std::uint16_t kInterruptControl = 0x3000;
inline constexpr std::uint16_t kInterruptAfterAll = 0x2000;
inline constexpr std::uint16_t kControlUsed = 0x3fff;  // the two highest bits have no function

}  // namespace mpf::ip330
