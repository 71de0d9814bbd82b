// SPDX-License-Identifier: MIT
// The registers of an SCC2698B, a chip with eight serial channels in four blocks, in the I/O space
// of a GreenSpring module.
//
//   request line  0                 1
//   block         0        1        2        3        32 bytes each
//   channel       a0  b1   a2  b3   a4  b5   a6  b7   16 bytes each
//
// Each register is a byte at an odd address. A value of a bit field that is 0 has no name here.
//
// Source   SCC2698B data sheet (Philips, 2000), tables 1 to 8.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mpf::scc2698b {

inline constexpr int kBlocks = 4;
inline constexpr int kChannels = 8;

// Registers of a channel. Two names with one offset: the first is read, the second is written.
enum ChannelRegister : std::size_t {
  kMr = 0x1,
  kSr = 0x3,
  kCsr = 0x3,
  kCr = 0x5,
  kRhr = 0x7,
  kThr = 0x7
};
// Registers of a block.
enum BlockRegister : std::size_t { kAcr = 0x9, kIsr = 0xb, kImr = 0xb, kOpcr = 0x1b };
// The interrupt vector, in the memory space of the module: the low byte of the word at 0.
inline constexpr std::size_t kVector = 1;

constexpr std::size_t at(int channel, ChannelRegister which) noexcept {
  return static_cast<std::size_t>(channel) * 0x10 + which;
}
constexpr std::size_t atBlock(int block, BlockRegister which) noexcept {
  return static_cast<std::size_t>(block) * 0x20 + which;
}

// MR1 and MR2 have the same address. After kCrResetMr the first access is to MR1, and all later
// ones are to MR2.
enum Mr1 : std::uint8_t {
  kMr1Bits = 0x03,
  kMr1Odd = 0x04,
  kMr1NoParity = 0x10,
  kMr1RxIntFull = 0x40,
  kMr1RxRts = 0x80
};
enum Mr2 : std::uint8_t {
  kMr2OneStop = 0x07,
  kMr2TwoStop = 0x0f,
  kMr2TxCts = 0x10,
  kMr2LocalLoopback = 0x80,
  kMr2Mode = 0xc0
};

enum Sr : std::uint8_t {
  kSrRxRdy = 0x01,
  kSrFfull = 0x02,
  kSrTxRdy = 0x04,
  kSrTxEmt = 0x08,
  kSrOverrun = 0x10,
  // of the byte that is read next:
  kSrParity = 0x20,
  kSrFraming = 0x40,
  kSrBreak = 0x80,
};
inline constexpr std::uint8_t kSrErrors = kSrOverrun | kSrParity | kSrFraming | kSrBreak;

// CR: the lower four bits enable and disable; the upper four bits are one command.
enum Cr : std::uint8_t {
  kCrEnableRx = 0x01,
  kCrDisableRx = 0x02,
  kCrEnableTx = 0x04,
  kCrDisableTx = 0x08,
  kCrResetMr = 0x10,
  kCrResetRx = 0x20,
  kCrResetTx = 0x30,
  kCrResetErrors = 0x40,
  kCrResetBreakChange = 0x50,
  kCrStartBreak = 0x60,
  kCrStopBreak = 0x70,
  kCrAssertRts = 0x80,
  kCrNegateRts = 0x90,
};

// The value of each register when no chip answers.
inline constexpr std::uint8_t kOnes = 0xff;

// Bits of ISR and IMR for channel a of a block; those for channel b are 4 bits higher.
enum Isr : std::uint8_t { kIsrTxRdy = 0x01, kIsrRxRdy = 0x02, kIsrBreakChange = 0x04 };
constexpr std::uint8_t isrOf(int channel, std::uint8_t bits) noexcept {
  return static_cast<std::uint8_t>(channel % 2 == 0 ? bits : bits << 4);
}

inline constexpr std::uint8_t kAcrSet2 = 0x80;  // the second set of baud rates
inline constexpr std::uint8_t kOpcrMppOutput = 0x80;  // MPP pins are outputs, MPO pins are RTSN

// The baud rates of set 2. The index is the code in CSR: for the receiver in the upper four bits,
// for the transmitter in the lower four bits.
inline constexpr std::array<int, 13> kBauds{75,   110,  38400, 150,  300,  600,  1200,
                                            2000, 2400, 4800,  1800, 9600, 19200};

}  // namespace mpf::scc2698b
