// SPDX-License-Identifier: MIT
// PrologixController: operations of a GPIB bus as commands of a Prologix controller.
//
//   write(22, "ID?")  ──►  ++addr 22, ++eoi 1, ID?       ┐
//   read(22)          ──►  ++addr 22, ++read eoi         ├─► PrologixLink::exchange()
//   serialPoll(22)    ──►  ++spoll 22                    ┘
//
// A read repeats ++read until the answer is complete or the deadline has passed, because one ++read
// waits for 3 s at most. Each waits for 3/4 of the time that is left, so that the controller gives
// up before the operation does, and is ready for the next operation.
//
// Threads  see GpibController.
// Trust    see PrologixLink.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>

#include <mpf/drivers/gpib/gpib_controller.h>

#include "drivers/gpib/peek_buffer.h"
#include "drivers/gpib/prologix_link.h"
#include "drivers/gpib/read_buffer.h"

namespace mpf {

class PrologixController final : public GpibController {
 public:
  //   address  as PrologixOptions
  //   throws   as openPrologix()
  explicit PrologixController(const std::string& address,
                              std::chrono::milliseconds patience = PrologixLink::kUsualPatience);

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
  [[nodiscard]] std::string description() const override { return link_.description(); }

 private:
  PrologixLink::Answer readOnce(const GpibAddress& from, const GpibReadLimits& limits,
                                Deadline deadline);
  // Executes `commands` that answer with one line, or with nothing.
  PrologixLink::Answer ask(std::string_view commands, Deadline deadline);
  [[nodiscard]] GpibResult unsupported(std::string_view why) const;

  PrologixLink link_;
  std::map<GpibAddress, ReadBuffer> received_;
  GpibPeekBuffer peek_;
};

}  // namespace mpf
