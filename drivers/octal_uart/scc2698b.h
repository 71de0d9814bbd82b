// SPDX-License-Identifier: MIT
// The registers of an SCC2698B, eight serial channels in four blocks, as GreenSpring's modules have
// it in their I/O space.
//
//   block    0        1        2        3           32 bytes each; request line 0 is that of blocks
//            0 and 1, line 1 that of 2 and 3
//   channel  a0  b1   a2  b3   a4  b5   a6  b7      16 bytes each; registers are bytes at odd
//            addresses
//
// Source   SCC2698B data sheet (Philips, 2000), tables 1 to 8; of bits with two values the one that
//          is 0 has no name.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mpf::scc2698b {

inline constexpr int kBlocks = 4;
inline constexpr int kChannels = 8;

// Of a channel; the first name is that of reading, the second that of writing where they differ.
enum ChannelRegister : std::size_t {
  kMr = 0x1,
  kSr = 0x3,
  kCsr = 0x3,
  kCr = 0x5,
  kRhr = 0x7,
  kThr = 0x7
};
// Of a block.
enum BlockRegister : std::size_t { kAcr = 0x9, kIsr = 0xb, kImr = 0xb, kOpcr = 0x1b };
// In the module's memory space: the low byte of the word at 0.
inline constexpr std::size_t kVector = 1;

constexpr std::size_t at(int channel, ChannelRegister which) noexcept {
  return static_cast<std::size_t>(channel) * 0x10 + which;
}
constexpr std::size_t atBlock(int block, BlockRegister which) noexcept {
  return static_cast<std::size_t>(block) * 0x20 + which;
}

// MR1, and MR2 behind the same address once MR1 has been accessed.
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
  kSrParity = 0x20,  // this and below: of the byte that is to be read next
  kSrFraming = 0x40,
  kSrBreak = 0x80,
};
inline constexpr std::uint8_t kSrErrors = kSrOverrun | kSrParity | kSrFraming | kSrBreak;

// The lower half of CR: bits. The upper half: one of these commands.
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

// What every register reads as when there is no chip.
inline constexpr std::uint8_t kOnes = 0xff;

// ISR and IMR: of a block's channel a, those of channel b are 4 bits higher.
enum Isr : std::uint8_t { kIsrTxRdy = 0x01, kIsrRxRdy = 0x02, kIsrBreakChange = 0x04 };
constexpr std::uint8_t isrOf(int channel, std::uint8_t bits) noexcept {
  return static_cast<std::uint8_t>(channel % 2 == 0 ? bits : bits << 4);
}

inline constexpr std::uint8_t kAcrSet2 = 0x80;  // the second set of baud rates
inline constexpr std::uint8_t kOpcrMppOutput = 0x80;  // MPP pins are outputs, MPO pins are RTSN

// Set 2; the index is what CSR has for the receiver (upper half) and for the transmitter (lower
// half).
inline constexpr std::array<int, 13> kBauds{75,   110,  38400, 150,  300,  600,  1200,
                                            2000, 2400, 4800,  1800, 9600, 19200};

}  // namespace mpf::scc2698b
