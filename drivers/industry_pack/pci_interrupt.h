// SPDX-License-Identifier: MIT
// PciInterrupt: the interrupt of a PCI board through uio_pci_generic. /dev/uioN reports it; the
// kernel masks it first.
//
//   poll(interrupt.descriptor());           // readable when it has come
//   if (interrupt.tryTake()) { ...; interrupt.unmask(); }
//
// Several processes may have such an object for the same board: each gets the interrupt, and each
// unmasks it when it is done.
//
// Threads  one calls tryTake(); any may call unmask().
// Crash    the constructor unmasks an interrupt that a killed process left masked.
// Source   Linux, UIO howto, "uio_pci_generic"; PCI 2.3, bit "interrupt disable".
#pragma once

#include <string>

#include <mpf/file_descriptor.h>

#include "drivers/industry_pack/pci_device.h"

namespace mpf {

class PciInterrupt {
 public:
  //   throws  std::runtime_error when the board is not bound to uio_pci_generic, or the permission
  //           for its files is missing; the message says what to do
  explicit PciInterrupt(const PciDevice& device);

  [[nodiscard]] int descriptor() const noexcept { return file_.get(); }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Takes an interrupt, without waiting. Returns false when no interrupt has come.
  //   throws  std::system_error when no interrupt can come any more (the board was unbound)
  [[nodiscard]] bool tryTake();
  void unmask() noexcept;

 private:
  std::string name_;
  FileDescriptor file_;
  FileDescriptor config_;
};

}  // namespace mpf
