// SPDX-License-Identifier: MIT
// Ti9914Controller: a GreenSpring IP-488 as a GpibController (manual, "Gpib Support").
//
//   auto& module = modules.create("a-ip488", "ipac", "IP_a", kIp488);
//   GpibBus bus(std::make_unique<Ti9914Controller>(module, Ti9914Chip::Options{.vector = 105}));
//
//   GpibBoardController ─► command(), send(), receive() ─► Ti9914Chip ─► registers
//
// A byte that was on the bus when the deadline passed cannot be taken back: then the chip is reset,
// and IFC ends the addressing of all instruments. After other failures UNT and UNL are enough. A
// read with an end of string holds off the talker after each byte; without it, only before the last
// byte.
//
// Threads  as GpibController; the handler of service requests runs on a thread of the chip.
// Crash    as Ti9914Chip.
// Trust    as GpibController.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include <mpf/drivers/industry_pack/module.h>

#include "drivers/gpib/board_controller.h"
#include "drivers/gpib/peek_buffer.h"
#include "drivers/ti9914/ti9914_chip.h"

namespace mpf {

class Ti9914Controller final : public GpibBoardController {
 public:
  // Sets up the chip.
  //   module   outlives this object
  //   throws   as Ti9914Chip; std::runtime_error when the module does not answer
  Ti9914Controller(IndustryPackModule& module, const Ti9914Chip::Options& options);

  GpibResult interfaceClear(Deadline deadline) override;
  GpibResult remoteEnable(bool on, Deadline deadline) override;
  [[nodiscard]] std::optional<bool> requestsService(Deadline deadline) override;
  bool onServiceRequest(std::function<void()> handler) override;
  void onPeek(GpibPeekHandler handler) override { peek_.setHandler(std::move(handler)); }
  [[nodiscard]] std::string description() const override;

 private:
  GpibResult command(Bytes commands, Deadline deadline) override;
  GpibResult send(Bytes data, bool sendEnd, Deadline deadline) override;
  GpibReadResult receive(const GpibReadLimits& limits, Deadline deadline) override;
  void recover(Bytes closing) override;

  GpibResult prepare();
  std::string setUp();
  void takeControl();
  void releaseAttention();
  GpibResult transmit(Bytes bytes, bool attention, bool sendEnd, Deadline deadline);
  GpibResult takeBytes(const GpibReadLimits& limits, Deadline deadline, GpibReadResult& result);
  void takeByte(std::uint32_t events, GpibReadResult& result);
  std::uint32_t wait(std::uint32_t wanted, Deadline deadline);
  GpibResult lost(const std::string& problem) const;
  GpibResult notAccepted(std::uint32_t events, bool attention, std::size_t at, std::size_t count);
  void serviceRequested();

  IndustryPackModule& module_;
  GpibPeekBuffer peek_;
  bool drivesAttention_ = false;
  bool hasByteOnBus_ = false;  // written, and neither accepted nor discarded

  std::mutex handlerMutex_;  // locked while the handler runs
  std::function<void()> serviceHandler_;
  Ti9914Chip chip_;  // last: its thread uses the members above
};

}  // namespace mpf
