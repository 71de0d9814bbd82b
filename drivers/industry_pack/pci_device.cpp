// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/pci_device.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "base/number.h"

namespace mpf {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInterruptDriver = "uio_pci_generic";

// Returns the first word of a file; empty when the file cannot be read.
std::string wordOf(const std::string& file) {
  std::string word;
  std::ifstream(file) >> word;
  return word;
}

std::string idText(std::uint16_t vendor, std::uint16_t device) {
  return fmt::format("0x{:04x}:0x{:04x}", vendor, device);
}
std::string idOf(const std::string& folder) {
  return wordOf(folder + "/vendor") + ":" + wordOf(folder + "/device");
}

bool isNumber(const std::string& text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char digit) { return std::isdigit(digit) != 0; });
}

std::string orNone(const std::vector<std::string>& addresses) {
  return addresses.empty() ? "none" : fmt::format("{}", fmt::join(addresses, ", "));
}

std::string chooseByNumber(const PciKind& kind, const std::vector<std::string>& boards,
                           const std::string& number) {
  if (const auto n = tryNumber<std::size_t>(number); n && *n < boards.size()) return boards[*n];
  throw std::runtime_error(
      boards.empty() ? fmt::format("this host has no {} (PCI id {})", kind.name,
                                   idText(kind.vendor, kind.device))
                     : fmt::format("this host has no {} number {}, counted from 0; its boards: {}",
                                   kind.name, number, orNone(boards)));
}

std::string choose(const PciPlaces& places, const PciKind& kind, const std::string& which) {
  const auto boards = findPciDevices(places, kind);
  if (which.empty() || isNumber(which))
    return chooseByNumber(kind, boards, which.empty() ? "0" : which);
  auto address = std::ranges::count(which, ':') == 1 ? "0000:" + which : which;
  if (which.find('/') == std::string::npos && fs::exists(places.devices + "/" + address))
    return address;
  throw std::runtime_error(
      fmt::format("no PCI device at {}; boards of kind {}: {}", which, kind.name, orNone(boards)));
}

struct Range {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;  // the last byte
};

// A line of `resource`: "0x00000000febf1000 0x00000000febf107f 0x0000000000040200".
Range windowRange(const std::string& file, int number) {
  std::ifstream lines(file);
  std::string line;
  for (int i = 0; i <= number; ++i) std::getline(lines, line);
  Range range;
  std::istringstream numbers(line);
  numbers >> std::hex >> range.begin >> range.end;
  return range;
}

}  // namespace

PciWindow::PciWindow(PciWindow&& other) noexcept
    : pages_(std::exchange(other.pages_, nullptr)),
      pageBytes_(other.pageBytes_),
      offset_(other.offset_),
      bytes_(other.bytes_) {}

PciWindow& PciWindow::operator=(PciWindow&& other) noexcept {
  std::swap(pages_, other.pages_);
  std::swap(pageBytes_, other.pageBytes_);
  std::swap(offset_, other.offset_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

PciWindow::~PciWindow() {
  if (pages_ != nullptr) ::munmap(pages_, pageBytes_);
}

std::vector<std::string> findPciDevices(const PciPlaces& places, const PciKind& kind) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(places.devices, ignored)) {
    if (idOf(entry.path().string()) == idText(kind.vendor, kind.device))
      found.push_back(entry.path().filename().string());
  }
  std::ranges::sort(found);
  return found;
}

PciDevice::PciDevice(PciPlaces places, PciKind kind, const std::string& which)
    : places_(std::move(places)), kind_(std::move(kind)), address_(choose(places_, kind_, which)) {
  expectKind();
  expectNoOtherDriver();
  enable();
}

std::string PciDevice::description() const { return fmt::format("{} at {}", kind_.name, address_); }

void PciDevice::expectKind() const {
  const auto found = idOf(places_.devices + "/" + address_);
  const auto wanted = idText(kind_.vendor, kind_.device);
  if (found != wanted)
    throw std::runtime_error(fmt::format("the PCI device at {} is not a {}: its id is {}, not {}",
                                         address_, kind_.name, found, wanted));
}

void PciDevice::expectNoOtherDriver() const {
  std::error_code none;
  const auto driver = fs::read_symlink(file("driver"), none).filename().string();
  if (driver.empty() || driver == kInterruptDriver) return;
  throw std::runtime_error(fmt::format(
      "{}: the board is bound to the kernel's driver {}. As root: echo {} > {}/unbind; {}",
      description(), driver, address_, file("driver"), howToGetInterrupts()));
}

// A board that is not bound to a driver may be disabled.
void PciDevice::enable() const {
  if (wordOf(file("enable")) != "0") return;
  const auto attribute = open("enable");
  if (::write(attribute.get(), "1", 1) == 1) return;
  throw std::runtime_error(fmt::format("{}: the board cannot be enabled ({}). As root: echo 1 > {}",
                                       description(), std::strerror(errno), file("enable")));
}

PciWindow PciDevice::map(int number, std::size_t offset, std::size_t bytes) const {
  const auto name = fmt::format("resource{}", number);
  const auto range = windowRange(file("resource"), number);
  if (range.begin + offset + bytes > range.end + 1)
    throw std::runtime_error(
        fmt::format("{}: window {} is too small for {} bytes at 0x{:x}; {} lists the windows",
                    description(), number, bytes, offset, file("resource")));
  const auto opened = open(name);
  // A small window may begin in the middle of a page.
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto first = range.begin % page + offset;
  const auto inPage = first % page;
  const auto length = (inPage + bytes + page - 1) / page * page;
  auto* const pages = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, opened.get(),
                             static_cast<off_t>(first - inPage));
  if (pages == MAP_FAILED) {
    throw std::runtime_error(
        fmt::format("{}: {} cannot be mapped ({}). Check that kernel lockdown is off and that no "
                    "other driver uses the board",
                    description(), file(name), std::strerror(errno)));
  }
  return {pages, length, inPage, bytes};
}

FileDescriptor PciDevice::open(const std::string& name) const {
  const auto path = file(name);
  FileDescriptor opened(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (opened) return opened;
  const int reason = errno;
  if (reason != EACCES && reason != EPERM)
    throw std::runtime_error(
        fmt::format("{}: {} cannot be opened: {}", description(), path, std::strerror(reason)));
  throw std::runtime_error(
      fmt::format("{0}: no permission to read and write {1}. As root, for a GROUP that you are in: "
                  "chgrp GROUP {2}/resource? {2}/config && "
                  "chmod g+rw {2}/resource? {2}/config; a udev rule does this at every boot",
                  description(), path, places_.devices + "/" + address_));
}

std::string PciDevice::interruptFile() const {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(file("uio"), none))
    return places_.dev + "/" + entry.path().filename().string();
  return {};
}

std::string PciDevice::howToGetInterrupts() const {
  return fmt::format("modprobe {0}; echo {0} > {1}; echo {2} > {3}", kInterruptDriver,
                     file("driver_override"), address_,
                     (fs::path(places_.devices).parent_path() / "drivers_probe").string());
}

}  // namespace mpf
