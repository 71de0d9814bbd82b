// SPDX-License-Identifier: MIT
// UsbtmcController: operations of a GPIB bus as system calls on a file of the kernel's driver
// usbtmc.
//
//            an operation begins
//   closed ─────────────────────► open       the first operation after an unplug opens the new
//          ◄─────────────────────            device
//           the device is gone
//
// The kernel aborts a transfer that times out (USBTMC_IOCTL_AUTO_ABORT), so that what the
// instrument sends for it later is not taken for the next answer.
//
// Threads  see GpibController.
// Trust    see GpibController.
#pragma once

#include <string>
#include <string_view>

#include <mpf/drivers/gpib/gpib_controller.h>

#include "drivers/gpib/peek_buffer.h"
#include "drivers/gpib/read_buffer.h"
#include "drivers/gpib/usbtmc_file.h"

namespace mpf {

class UsbtmcController final : public GpibController {
 public:
  //   device  for messages to people
  UsbtmcController(const std::string& device, std::unique_ptr<UsbtmcFile> file);

  GpibResult write(const GpibAddress& to, Bytes data, bool sendEnd, Deadline deadline) override;
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits,
                      Deadline deadline) override;
  GpibResult sendCommands(Bytes commands, Deadline deadline) override;
  GpibPollResult serialPoll(const GpibAddress& at, Deadline deadline) override;
  GpibResult clearAll(Deadline deadline) override;
  GpibResult clear(const GpibAddress& at, Deadline deadline) override;
  GpibResult trigger(std::span<const GpibAddress> at, Deadline deadline) override;
  GpibResult interfaceClear(Deadline deadline) override;
  GpibResult remoteEnable(bool on, Deadline deadline) override;
  GpibResult localLockout(Deadline deadline) override;
  GpibResult goToLocal(const GpibAddress& at, Deadline deadline) override;
  [[nodiscard]] std::optional<bool> requestsService(Deadline deadline) override;
  bool onServiceRequest(std::function<void()> /*handler*/) override { return false; }
  void onPeek(GpibPeekHandler handler) override { peek_.setHandler(std::move(handler)); }
  [[nodiscard]] std::string description() const override { return description_; }

 private:
  enum class State : std::uint8_t { closed, open };

  // Opens the device when it is closed, and sets the time that the kernel waits.
  GpibResult prepare(Deadline deadline);
  GpibResult open();
  GpibResult readOnce(const GpibReadLimits& limits);
  // One ioctl as an operation.
  GpibResult control(std::string_view what, unsigned long request, void* argument,
                     Deadline deadline);
  GpibResult controlIf(std::uint8_t capability, std::string_view what, unsigned long request,
                       Deadline deadline);
  // What the negative result of a system call means.
  GpibResult failed(std::string_view what, std::int64_t result);
  [[nodiscard]] GpibResult unsupported(std::string_view what) const;

  const std::string description_;
  const std::unique_ptr<UsbtmcFile> file_;
  State state_ = State::closed;
  std::uint8_t capabilities_ = 0;  // USBTMC488_CAPABILITY_...
  ReadBuffer received_;
  GpibPeekBuffer peek_;
};

}  // namespace mpf
