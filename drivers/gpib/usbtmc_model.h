// SPDX-License-Identifier: MIT
// UsbtmcModel: a USB instrument behind the kernel's driver usbtmc as a model. The instrument itself
// is a GpibInstrumentModel.
//
//   UsbtmcController ── system calls ──► UsbtmcModel ── bytes ──► instrument
//
// It has the limits of the driver: a timeout of 100 ms at least, ENODEV after an unplug until the
// device is opened again, EINVAL for what the instrument cannot do.
//
// Threads  one at a time.
// Source   drivers/usb/class/usbtmc.c of Linux.
#pragma once

#include <cstdint>
#include <memory>

#include "drivers/gpib/instrument_model.h"
#include "drivers/gpib/usbtmc_file.h"

namespace mpf {

class UsbtmcModel final : public UsbtmcFile {
 public:
  static constexpr std::uint8_t kAllCapabilities = 0xff;  // USBTMC488_CAPABILITY_...

  explicit UsbtmcModel(std::shared_ptr<GpibInstrumentModel> instrument)
      : instrument_(std::move(instrument)) {}

  // --- faults
  // What the instrument can do; to be called while the file is closed.
  void haveCapabilities(std::uint8_t usb488, bool stopsAtByte) {
    capabilities_ = usb488;
    stopsAtByte_ = stopsAtByte;
  }
  // The open file fails from now on, and open() as long as the device is absent.
  void unplug() {
    isPlugged_ = false;
    isGone_ = true;
  }
  void plugIn() { isPlugged_ = true; }
  // The next system call other than open() fails with this error number.
  void failOnce(int error) { failOnce_ = error; }

  int open() override;
  void close() noexcept override {}
  std::int64_t write(std::span<const std::uint8_t> bytes) override;
  std::int64_t read(std::span<std::uint8_t> bytes) override;
  int control(unsigned long request, void* argument) override;
  int pollServiceRequest() override;

 private:
  int begin();
  int configure(unsigned long request, void* argument);
  int operate(unsigned long request, void* argument);
  [[nodiscard]] bool can(std::uint8_t capability) const {
    return (capabilities_ & capability) != 0;
  }

  const std::shared_ptr<GpibInstrumentModel> instrument_;
  std::uint8_t capabilities_ = kAllCapabilities;
  bool stopsAtByte_ = true;
  bool isPlugged_ = true;
  bool isGone_ = true;  // the file that was opened last; no file was opened yet
  int failOnce_ = 0;
  std::uint32_t timeoutMs_ = 5000;
  bool sendsEnd_ = true;
  int stopAt_ = -1;  // a byte; negative: none
  std::uint8_t attributes_ = 0;  // of the last answer
};

}  // namespace mpf
