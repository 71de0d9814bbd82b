// SPDX-License-Identifier: MIT
// UsbtmcFile: the system calls on a file of the kernel's driver usbtmc. UsbtmcController makes
// them; the kernel or UsbtmcModel executes them.
//
// Each function returns the result of the system call, or minus the error number.
//
// Threads  one at a time.
// Source   <linux/usb/tmc.h>, drivers/usb/class/usbtmc.c of Linux.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace mpf {

// Bits of USBTMC_IOCTL_MSG_IN_ATTR, which concerns the last read().
inline constexpr std::uint8_t kUsbtmcEndOfMessage = 0x01;
inline constexpr std::uint8_t kUsbtmcStoppedAtByte = 0x02;

class UsbtmcFile {
 public:
  UsbtmcFile() = default;
  UsbtmcFile(const UsbtmcFile&) = delete;
  UsbtmcFile& operator=(const UsbtmcFile&) = delete;
  virtual ~UsbtmcFile() = default;

  [[nodiscard]] virtual int open() = 0;
  virtual void close() noexcept = 0;
  // Sends one message or a part of it (USBTMC_IOCTL_EOM_ENABLE).
  [[nodiscard]] virtual std::int64_t write(std::span<const std::uint8_t> bytes) = 0;
  // Asks for at most bytes.size() bytes of the answer.
  [[nodiscard]] virtual std::int64_t read(std::span<std::uint8_t> bytes) = 0;
  // ioctl(2). A request without argument ignores `argument`.
  [[nodiscard]] virtual int control(unsigned long request, void* argument) = 0;
  // poll(2) for POLLPRI: 1 when a service request was noted, else 0.
  [[nodiscard]] virtual int pollServiceRequest() = 0;
};

// The file at `path`, which is not open yet.
[[nodiscard]] std::unique_ptr<UsbtmcFile> usbtmcDeviceFile(std::string path);

}  // namespace mpf
