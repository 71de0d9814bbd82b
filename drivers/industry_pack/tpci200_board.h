// SPDX-License-Identifier: MIT
// Tpci200Board: the registers of a TPCI200 and the windows of its sites. Tpci200 decides which
// process uses them.
//
//   window (BAR)  0  the bridge, a PLX PCI9030: sets which windows swap the byte order
//                 2  the board: revision 0x00, control of sites A to D 0x02 to 0x08, reset 0x0a,
//                    status 0x0c; 16 bits, little-endian
//                 3  0x100 bytes for each site: I/O 0x00, ID 0x80, interrupt acknowledge 0xc0
//                 4  8 MiB for each site: memory, 16 bits wide
//
// The constructor makes windows 3 and 4 swap the byte order, so that bytes have the addresses of
// the modules' bus, which is big-endian.
//
// Threads  any number of callers at a time. Accesses are serialised, since a time-out bit belongs
//          to the last access to its site.
// Source   Linux drivers/ipack/carriers/tpci200 and the PCI9030 data book
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>

#include <mpf/drivers/industry_pack/memory_registers.h>

#include "drivers/industry_pack/pci_device.h"

namespace mpf {

class Tpci200Board {
 public:
  static constexpr std::uint16_t kGone = 0xffff;  // read from an absent board; not a valid status

  static constexpr int kSitesWindow = 3;
  static constexpr std::size_t kSiteBytes = 0x100;
  static constexpr std::size_t kIoBytes = 0x80;  // of a site; the ID space follows
  static constexpr std::size_t kIdBytes = 0x40;
  static constexpr int kMemoryWindow = 4;
  static constexpr std::size_t kMemoryBytes = 8U << 20;  // of a site

  //   throws  std::runtime_error when a window cannot be mapped, or all bits of the bridge read as
  //           ones
  explicit Tpci200Board(const PciDevice& pci);

  // Status bit 2 * site + line: the line is active and enabled.
  [[nodiscard]] static constexpr std::uint16_t statusBit(std::size_t site, int line) noexcept {
    return static_cast<std::uint16_t>(1U << (2 * site + static_cast<std::size_t>(line)));
  }
  [[nodiscard]] std::uint16_t status();

  // Passes on interrupts of these lines only; bit 0: IntReq0*, bit 1: IntReq1*. All other settings
  // of the site become those after power-up, for example a clock of 8 MHz.
  void setLines(std::size_t site, unsigned lines);
  // Sends the interrupt acknowledge cycle to the module, which may then release the line.
  void acknowledge(std::size_t site, int line);

 private:
  friend class Tpci200Registers;
  // Returns whether the last access to the site timed out, and clears the time-out. Call with
  // mutex_ held.
  bool takeTimeOut(std::size_t site);
  std::uint16_t read(std::size_t offset) const noexcept;
  void write(std::size_t offset, std::uint16_t value) noexcept;

  std::mutex mutex_;
  PciWindow window_;
  PciWindow sites_;
};

// An address space of a site. An access of 32 bits is two cycles.
class Tpci200Registers final : public Registers {
 public:
  Tpci200Registers(Tpci200Board& board, std::size_t site, PciWindow window)
      : board_(board),
        site_(site),
        window_(std::move(window)),
        registers_(window_.data(), window_.size()) {}
  [[nodiscard]] std::size_t size() const noexcept override { return window_.size(); }

 private:
  template <class Value, class Read>
  Value read(Read read);
  template <class Write>
  void write(Write write);
  std::uint8_t doRead8(std::size_t offset) override;
  std::uint16_t doRead16(std::size_t offset) override;
  std::uint32_t doRead32(std::size_t offset) override;
  void doWrite8(std::size_t offset, std::uint8_t value) override;
  void doWrite16(std::size_t offset, std::uint16_t value) override;
  void doWrite32(std::size_t offset, std::uint32_t value) override;

  Tpci200Board& board_;
  std::size_t site_;
  PciWindow window_;
  MemoryRegisters registers_;
};

}  // namespace mpf
