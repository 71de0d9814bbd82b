// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/pci_interrupt.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <endian.h>
#include <fmt/format.h>
#include <stdexcept>

#include "base/system_call.h"

namespace mpf {
namespace {

// offset in the configuration registers: 16 bits, little-endian
constexpr off_t kCommand = 4;
constexpr std::uint16_t kInterruptMasked = 0x0400;  // the bit "interrupt disable"

FileDescriptor openFile(const PciDevice& device, const std::string& name) {
  if (name.empty())
    throw std::runtime_error("the board is not bound to uio_pci_generic; as root: " +
                             device.howToGetInterrupts());
  FileDescriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file) return file;
  throw std::runtime_error(
      fmt::format("{} cannot be opened ({}); as root, for a GROUP that you are in: chgrp GROUP {} "
                  "&& chmod g+r {}",
                  name, std::strerror(errno), name, name));
}

}  // namespace

PciInterrupt::PciInterrupt(const PciDevice& device)
    : name_(device.interruptFile()),
      file_(openFile(device, name_)),
      config_(device.open("config")) {
  unmask();
}

bool PciInterrupt::tryTake() {
  std::uint32_t count = 0;
  const auto bytes = retryInterrupted([&] { return ::read(file_.get(), &count, sizeof(count)); });
  if (bytes == sizeof(count)) return true;
  if (bytes < 0 && errno == EAGAIN) return false;
  throwSystemError(bytes < 0 ? errno : ENODEV, "read", name_);
}

// Writes the whole register: QEMU notices a change of this bit only when the lower byte is written,
// too.
void PciInterrupt::unmask() noexcept {
  std::uint16_t command = 0;
  if (::pread(config_.get(), &command, sizeof(command), kCommand) != sizeof(command)) return;
  command = htole16(static_cast<std::uint16_t>(le16toh(command) & ~kInterruptMasked));
  static_cast<void>(::pwrite(config_.get(), &command, sizeof(command), kCommand));
}

}  // namespace mpf
