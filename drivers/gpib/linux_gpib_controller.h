// SPDX-License-Identifier: MIT
// LinuxGpibController: a board of Linux GPIB as a GpibController. It needs no device descriptors of
// libgpib, because GpibBoardController sends the addresses.
//
// After a failure it sends the commands that end the operation; if that fails too, IFC.
//
// Threads  see GpibController.
// Trust    see GpibController.
#pragma once

#include <string>
#include <string_view>

#include "drivers/gpib/board_controller.h"
#include "drivers/gpib/libgpib.h"
#include "drivers/gpib/peek_buffer.h"

namespace mpf {

class LinuxGpibController final : public GpibBoardController {
 public:
  //   own  primary address of the board
  LinuxGpibController(int board, LibGpib library, std::uint8_t own);

  GpibResult interfaceClear(Deadline deadline) override;
  GpibResult remoteEnable(bool on, Deadline deadline) override;
  [[nodiscard]] std::optional<bool> requestsService(Deadline deadline) override;
  bool onServiceRequest(std::function<void()> /*handler*/) override { return false; }
  void onPeek(GpibPeekHandler handler) override { peek_.setHandler(std::move(handler)); }
  [[nodiscard]] std::string description() const override { return description_; }

 private:
  GpibResult command(Bytes commands, Deadline deadline) override;
  GpibResult send(Bytes data, bool sendEnd, Deadline deadline) override;
  GpibReadResult receive(const GpibReadLimits& limits, Deadline deadline) override;
  void recover(Bytes closing) override;
  // The number of bytes that the last call has transferred, at most `wanted`.
  [[nodiscard]] std::size_t transferred(int status, std::size_t wanted) const;
  [[nodiscard]] GpibResult resultOf(std::string_view what, int status) const;

  const int board_;
  const std::string description_;
  const LibGpib library_;
  GpibPeekBuffer peek_;
};

}  // namespace mpf
