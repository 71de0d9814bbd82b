// SPDX-License-Identifier: MIT
// PciDevice: one PCI board of this host, through the files that Linux has for it; without a kernel driver of ours.
//
//   /sys/bus/pci/devices/0000:03:00.0/   vendor device driver enable   what it is, who has it
//                                        resource resource0 ... 5      its windows
//                                        config                        its configuration registers
//                                        uio/uio0                      with driver uio_pci_generic: /dev/uio0, its interrupt
//
// Threads  any, after construction.
// Crash    a mapped window of a board that the kernel removes (echo 1 > remove) kills the process that touches it, by SIGBUS.
// Trust    the rights of these files say who may use the board. Who may write `config` and the windows may do whatever the board can.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <mpf/base/file_descriptor.h>

namespace mpf {

// Where those files are. Elsewhere in tests.
struct PciPlaces {
  std::string devices = "/sys/bus/pci/devices";
  std::string dev = "/dev";
};

struct PciKind {
  std::string name;  // "TPCI200"
  std::uint16_t vendor = 0;
  std::uint16_t device = 0;
};

// A part of a board's memory in this process.
class PciWindow {
 public:
  PciWindow() = default;
  PciWindow(void* pages, std::size_t pageBytes, std::size_t offset, std::size_t bytes) noexcept
      : pages_(pages), pageBytes_(pageBytes), offset_(offset), bytes_(bytes) {}
  PciWindow(PciWindow&& other) noexcept;
  PciWindow& operator=(PciWindow&& other) noexcept;
  ~PciWindow();

  [[nodiscard]] volatile std::byte* data() const noexcept { return static_cast<volatile std::byte*>(pages_) + offset_; }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_; }

 private:
  void* pages_ = nullptr;
  std::size_t pageBytes_ = 0;
  std::size_t offset_ = 0;
  std::size_t bytes_ = 0;
};

class PciDevice {
 public:
  //   which   its address ("0000:03:00.0", "03:00.0"), or its number among the boards of this kind, from "0"; empty: the first
  //   throws  std::runtime_error in plain words: none there, another kind of board, a kernel driver that has it, no right to use it
  PciDevice(PciPlaces places, PciKind kind, const std::string& which);

  [[nodiscard]] const std::string& address() const noexcept { return address_; }
  // "TPCI200 at 0000:03:00.0"
  [[nodiscard]] std::string description() const;

  // `bytes` bytes from `offset` in window (BAR) `number`.
  //   throws  std::runtime_error in plain words
  [[nodiscard]] PciWindow map(int number, std::size_t offset, std::size_t bytes) const;
  // A file of this board, for reading and writing; "resource3", "config".
  //   throws  std::runtime_error that says what to do when this process has no right to
  [[nodiscard]] FileDescriptor open(const std::string& name) const;
  // The device file of its interrupt; empty when uio_pci_generic has not got the board.
  [[nodiscard]] std::string interruptFile() const;
  // The shell commands that give the board to uio_pci_generic.
  [[nodiscard]] std::string howToGetInterrupts() const;

 private:
  [[nodiscard]] std::string file(const std::string& name) const { return places_.devices + "/" + address_ + "/" + name; }
  void expectKind() const;
  void expectNoOtherDriver() const;
  void enable() const;

  PciPlaces places_;
  PciKind kind_;
  std::string address_;
};

// The addresses of all boards of that kind, sorted.
[[nodiscard]] std::vector<std::string> findPciDevices(const PciPlaces& places, const PciKind& kind);

}  // namespace mpf
