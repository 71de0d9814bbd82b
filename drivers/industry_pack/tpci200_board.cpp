// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/tpci200_board.h"

#include <endian.h>
#include <stdexcept>

namespace mpf {
namespace {

constexpr int kBridgeWindow = 0;
constexpr int kBoardWindow = 2;

// The bridge's descriptors of the local spaces 0, 1 and 2, which are the windows 2, 3 and 4.
constexpr std::size_t kBridgeBytes = 0x80;
constexpr std::size_t kSpace0 = 0x28;
constexpr std::size_t kSpace1 = 0x2c;
constexpr std::size_t kSpace2 = 0x30;
constexpr std::uint32_t kBigEndian = 1U << 24;

constexpr std::size_t kBoardBytes = 0x10;
constexpr std::size_t kControl = 0x02;  // of site A; 2 bytes for each site
constexpr std::size_t kStatus = 0x0c;
constexpr unsigned kPassLine0 = 1U << 6;  // in a control register; the next bit is line 1
constexpr unsigned kTimeOut = 1U << 12;   // in the status; of site A

constexpr std::size_t kAcknowledge = 0xc0;  // 2 bytes for each line
constexpr std::size_t kAllSites = 4 * Tpci200Board::kSiteBytes;

template <class Value>
volatile Value& at(const PciWindow& window, std::size_t offset) noexcept {
  return *reinterpret_cast<volatile Value*>(window.data() + offset);
}

void setByteOrder(const PciWindow& bridge, std::size_t space, bool isBig) {
  const auto before = le32toh(at<std::uint32_t>(bridge, space));
  const auto wanted = isBig ? before | kBigEndian : before & ~kBigEndian;
  if (wanted != before) at<std::uint32_t>(bridge, space) = htole32(wanted);
}

}  // namespace

Tpci200Board::Tpci200Board(const PciDevice& pci)
    : window_(pci.map(kBoardWindow, 0, kBoardBytes)), sites_(pci.map(kSitesWindow, 0, kAllSites)) {
  const auto bridge = pci.map(kBridgeWindow, 0, kBridgeBytes);
  if (at<std::uint32_t>(bridge, kSpace1) == UINT32_MAX)
    throw std::runtime_error(
        pci.description() +
        " does not answer: all bits of its bridge read as ones; check the board and the bus");
  setByteOrder(bridge, kSpace0, false);
  setByteOrder(bridge, kSpace1, true);
  setByteOrder(bridge, kSpace2, true);
}

std::uint16_t Tpci200Board::read(std::size_t offset) const noexcept {
  return le16toh(at<std::uint16_t>(window_, offset));
}
void Tpci200Board::write(std::size_t offset, std::uint16_t value) noexcept {
  at<std::uint16_t>(window_, offset) = htole16(value);
}

std::uint16_t Tpci200Board::status() {
  const std::lock_guard lock(mutex_);
  return read(kStatus);
}

void Tpci200Board::setLines(std::size_t site, unsigned lines) {
  const std::lock_guard lock(mutex_);
  write(kControl + 2 * site, static_cast<std::uint16_t>(lines * kPassLine0));
  static_cast<void>(read(kStatus));  // the read makes sure that the write has arrived
}

void Tpci200Board::acknowledge(std::size_t site, int line) {
  const std::lock_guard lock(mutex_);
  [[maybe_unused]] const std::uint16_t vector = at<std::uint16_t>(
      sites_, site * kSiteBytes + kAcknowledge + 2 * static_cast<std::size_t>(line));
  takeTimeOut(site);  // a module may leave this cycle unanswered
  write(kStatus, statusBit(site, line));
}

bool Tpci200Board::takeTimeOut(std::size_t site) {
  const auto bit = static_cast<std::uint16_t>(kTimeOut << site);
  if ((read(kStatus) & bit) == 0) return false;
  write(kStatus, bit);
  return true;
}

template <class Value, class Read>
Value Tpci200Registers::read(Read read) {
  const std::lock_guard lock(board_.mutex_);
  const Value value = read();
  return board_.takeTimeOut(site_) ? static_cast<Value>(~Value{0}) : value;
}

// A write is still under way when the store returns. Reading the status waits for its end, so that
// its time-out is not attributed to the next access.
template <class Write>
void Tpci200Registers::write(Write write) {
  const std::lock_guard lock(board_.mutex_);
  write();
  board_.takeTimeOut(site_);
}

std::uint8_t Tpci200Registers::doRead8(std::size_t offset) {
  return read<std::uint8_t>([&] { return registers_.read8(offset); });
}
std::uint16_t Tpci200Registers::doRead16(std::size_t offset) {
  return read<std::uint16_t>([&] { return registers_.read16(offset); });
}
std::uint32_t Tpci200Registers::doRead32(std::size_t offset) {
  const std::uint32_t high = doRead16(offset);
  return high << 16 | doRead16(offset + 2);
}
void Tpci200Registers::doWrite8(std::size_t offset, std::uint8_t value) {
  write([&] { registers_.write8(offset, value); });
}
void Tpci200Registers::doWrite16(std::size_t offset, std::uint16_t value) {
  write([&] { registers_.write16(offset, value); });
}
void Tpci200Registers::doWrite32(std::size_t offset, std::uint32_t value) {
  doWrite16(offset, static_cast<std::uint16_t>(value >> 16));
  doWrite16(offset + 2, static_cast<std::uint16_t>(value));
}

}  // namespace mpf
