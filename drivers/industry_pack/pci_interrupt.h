// SPDX-License-Identifier: MIT
// PciInterrupt: a PCI board's interrupt through uio_pci_generic: /dev/uioN tells of it, and the kernel has masked it by then.
//
//   poll(interrupt.descriptor());           // readable: it came
//   if (interrupt.tryTake()) { ...; interrupt.unmask(); }
//
// Several processes may each have one for the same board: each is told, whoever is ready unmasks it.
//
// Threads  one takes; unmask() from any.
// Crash    an interrupt that a killed process left masked is unmasked by the next construction.
#pragma once

#include <string>

#include <mpf/base/file_descriptor.h>
#include <mpf/drivers/industry_pack/pci_device.h>

namespace mpf {

class PciInterrupt {
 public:
  //   throws  std::runtime_error in plain words when uio_pci_generic has not got the board, or there is no right to its files
  explicit PciInterrupt(const PciDevice& device);

  [[nodiscard]] int descriptor() const noexcept { return file_.get(); }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // False: it did not come.
  //   throws  std::system_error when it never will any more
  [[nodiscard]] bool tryTake();
  void unmask() noexcept;

 private:
  std::string name_;
  FileDescriptor file_;
  FileDescriptor config_;
};

}  // namespace mpf
