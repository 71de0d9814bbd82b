// SPDX-License-Identifier: MIT
// LinuxGpibController: operations of a GPIB bus as calls of libgpib for a board. It sends the
// addresses itself, so it needs no device descriptors, and secondary addresses and group triggers
// are commands like any other.
//
//   write(22, "ID?")   command: MTA 0, UNL, LAG 22    write: "ID?" END    command: UNT UNL
//   read(22)           command: UNL, MLA 0, TAG 22    read: ... END       command: UNT UNL
//
// After a failure it sends UNT UNL; if that fails too, IFC.
//
// Threads  see GpibController.
// Trust    see GpibController.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <mpf/drivers/gpib/gpib_controller.h>

#include "drivers/gpib/libgpib.h"

namespace mpf {

class LinuxGpibController final : public GpibController {
 public:
  // Loads the library.
  //   throws  as LibGpib
  LinuxGpibController(int board, const std::string& library);

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
  void onPeek(GpibPeekHandler handler) override { peek_ = std::move(handler); }
  [[nodiscard]] std::string description() const override { return description_; }

 private:
  using Commands = std::vector<std::uint8_t>;

  // Appends the command that makes the board a talker or listener.
  GpibResult addBoard(std::uint8_t base, Commands& commands) const;
  // Sends `commands` to the listeners `at`.
  GpibResult addressed(std::span<const GpibAddress> at, std::uint8_t command, Deadline deadline);
  GpibResult transmit(Bytes data, bool sendEnd, Deadline deadline);
  GpibReadResult receive(const GpibReadLimits& limits, Deadline deadline);
  // Ends an operation: nobody talks or listens afterwards.
  void unaddress(const GpibResult& result);
  // Whether the last call failed with a system error, and count() is its number.
  [[nodiscard]] bool isSystemError() const;
  [[nodiscard]] GpibResult resultOf(std::string_view what, int status) const;

  const int board_;
  const std::string description_;
  const LibGpib library_;
  GpibPeekHandler peek_;
};

}  // namespace mpf
