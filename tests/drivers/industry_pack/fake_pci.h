// SPDX-License-Identifier: MIT
// FakePci: a folder with plain files in place of those that Linux has for PCI boards. Windows are
// memory that keeps what is written.
#pragma once

#include <fcntl.h>
#include <sys/fsuid.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <endian.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <string>

#include "drivers/industry_pack/pci_device.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {

// Opens files without the privileges of root.
class NoRoot {
 public:
  NoRoot() { ::setfsuid(65534); }
  ~NoRoot() { ::setfsuid(::geteuid()); }
  NoRoot(const NoRoot&) = delete;
  NoRoot& operator=(const NoRoot&) = delete;
};

class FakePci {
 public:
  // The offset of the small windows in their pages.
  static constexpr std::size_t kInPage = 0x80;

  FakePci() {
    std::filesystem::create_directories(folder_.path() / "dev");
    // tests change the permissions of the files inside
    std::filesystem::permissions(folder_.path(), std::filesystem::perms::all);
  }

  [[nodiscard]] PciPlaces places() const {
    return {.devices = (folder_.path() / "devices").string(),
            .dev = (folder_.path() / "dev").string()};
  }
  [[nodiscard]] std::string file(const std::string& address, const std::string& name) const {
    return places().devices + "/" + address + "/" + name;
  }

  void write(const std::string& address, const std::string& name, const std::string& text) const {
    std::ofstream(file(address, name)) << text;
  }

  // Adds an enabled board that is not bound to a driver.
  void add(const std::string& address, const std::string& vendor = "0x1498",
           const std::string& device = "0x30c8") const {
    std::filesystem::create_directories(places().devices + "/" + address);
    write(address, "vendor", vendor + "\n");
    write(address, "device", device + "\n");
    write(address, "enable", "1\n");
    write(address, "config", std::string(64, '\4'));
    std::string windows;
    for (const std::uint64_t bytes : {0x80UL, 0x80UL, 0x100UL, 0x400UL, 0x2000000UL, 0x1000000UL}) {
      const auto begin = 0xfeb00000UL + (bytes < 4096 ? kInPage : 0);
      windows += fmt::format("0x{:016x} 0x{:016x} 0x{:016x}\n", begin, begin + bytes - 1, 0x40200);
    }
    write(address, "resource", windows);
    for (const int number : {0, 2, 3, 4}) {
      write(address, fmt::format("resource{}", number), "");
      std::filesystem::resize_file(file(address, fmt::format("resource{}", number)),
                                   number == 4 ? 0x2000000 : 4096);
    }
  }
  // Binds the board to uio_pci_generic, as /dev/uio7. A write to that file is an interrupt.
  void giveInterrupt(const std::string& address) {
    setDriver(address, "uio_pci_generic");
    std::filesystem::create_directories(file(address, "uio/uio7"));
    ::mkfifo((places().dev + "/uio7").c_str(), 0600);
    interrupt_.reset(::open((places().dev + "/uio7").c_str(), O_RDWR | O_CLOEXEC));
  }
  void setDriver(const std::string& address, const std::string& driver) const {
    std::filesystem::create_directories(folder_.path() / "drivers" / driver);
    std::filesystem::create_directory_symlink(folder_.path() / "drivers" / driver,
                                              file(address, "driver"));
  }
  void interrupt() const {
    const std::uint32_t count = 1;
    ASSERT_EQ(::write(interrupt_.get(), &count, sizeof(count)), ssize_t{sizeof(count)});
  }

  void takeInterruptAway() { interrupt_.reset(); }

  // Access to the registers from the side of the board. It uses the file, since another thread uses
  // the mapping.
  template <class Value>
  [[nodiscard]] Value get(const std::string& address, const std::string& name,
                          std::size_t offset) const {
    const FileDescriptor opened(::open(file(address, name).c_str(), O_RDONLY | O_CLOEXEC));
    Value value{};
    EXPECT_EQ(::pread(opened.get(), &value, sizeof(value), static_cast<off_t>(offset)),
              ssize_t{sizeof(value)});
    return value;
  }
  template <class Value>
  void set(const std::string& address, const std::string& name, std::size_t offset,
           Value value) const {
    const FileDescriptor opened(::open(file(address, name).c_str(), O_WRONLY | O_CLOEXEC));
    EXPECT_EQ(::pwrite(opened.get(), &value, sizeof(value), static_cast<off_t>(offset)),
              ssize_t{sizeof(value)});
  }

 private:
  TemporaryFolder folder_;
  FileDescriptor interrupt_;
};

}  // namespace mpf::test
