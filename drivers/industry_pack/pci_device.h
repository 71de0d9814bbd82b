// SPDX-License-Identifier: MIT
// PciDevice: access to one PCI board of this host through the files that Linux has for it; needs no
// kernel driver of its own.
//
//   /sys/bus/pci/devices/0000:03:00.0/   vendor device driver enable   IDs, bound driver
//                                        resource resource0 ... 5      the windows (BARs)
//                                        config                        the configuration registers
//                                        uio/uio0                      with driver uio_pci_generic:
//                                        /dev/uio0, the interrupt
//
// Threads  any number of callers at a time.
// Crash    if the kernel removes the board (echo 1 > remove), the next access to a mapped window
//          raises SIGBUS, which ends the process.
// Trust    the permissions of these files control access. A process that may write `config` and the
//          windows can use the board without restriction.
// Source   Linux, Documentation/PCI/sysfs-pci.rst and the UIO howto.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf {

// The folders of these files; tests use others.
struct PciPlaces {
  std::string devices = "/sys/bus/pci/devices";
  std::string dev = "/dev";
};

struct PciKind {
  std::string name;  // "TPCI200"
  std::uint16_t vendor = 0;
  std::uint16_t device = 0;
};

// A mapped part of a window of a board; unmapped when it is destroyed.
class PciWindow {
 public:
  PciWindow() = default;
  PciWindow(void* pages, std::size_t pageBytes, std::size_t offset, std::size_t bytes) noexcept
      : pages_(pages), pageBytes_(pageBytes), offset_(offset), bytes_(bytes) {}
  PciWindow(PciWindow&& other) noexcept;
  PciWindow& operator=(PciWindow&& other) noexcept;
  ~PciWindow();

  [[nodiscard]] volatile std::byte* data() const noexcept {
    return static_cast<volatile std::byte*>(pages_) + offset_;
  }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_; }

 private:
  void* pages_ = nullptr;
  std::size_t pageBytes_ = 0;
  std::size_t offset_ = 0;
  std::size_t bytes_ = 0;
};

class PciDevice {
 public:
  // Finds and enables a board.
  //
  //   which   the address ("0000:03:00.0", "03:00.0"), or the number of the board among those of
  //           this kind, counted from "0"; empty: the first
  //   throws  std::runtime_error when the board is absent, of another kind, bound to another kernel
  //           driver, or not accessible; the message says what to do
  PciDevice(PciPlaces places, PciKind kind, const std::string& which);

  [[nodiscard]] const std::string& address() const noexcept { return address_; }
  // For messages to people: "TPCI200 at 0000:03:00.0".
  [[nodiscard]] std::string description() const;

  // Maps `bytes` bytes from `offset` in window (BAR) `number`.
  //   throws  std::runtime_error when the window is too small or cannot be mapped
  [[nodiscard]] PciWindow map(int number, std::size_t offset, std::size_t bytes) const;
  // Opens a file of this board, "resource3" or "config", for reading and writing.
  //   throws  std::runtime_error, which says what to do when the permission is missing
  [[nodiscard]] FileDescriptor open(const std::string& name) const;
  // The device file of the interrupt; empty when the board is not bound to uio_pci_generic.
  [[nodiscard]] std::string interruptFile() const;
  // The shell commands that bind the board to uio_pci_generic.
  [[nodiscard]] std::string howToGetInterrupts() const;

 private:
  [[nodiscard]] std::string file(const std::string& name) const {
    return places_.devices + "/" + address_ + "/" + name;
  }
  void expectKind() const;
  void expectNoOtherDriver() const;
  void enable() const;

  PciPlaces places_;
  PciKind kind_;
  std::string address_;
};

// The addresses of all boards of this kind, sorted.
[[nodiscard]] std::vector<std::string> findPciDevices(const PciPlaces& places, const PciKind& kind);

}  // namespace mpf
