// SPDX-License-Identifier: MIT
// GpibBoardController: the operations of a controller that sends the bytes of each operation
// itself, addresses included; they are built of four primitives. For a chip (TI9914), or a board of
// Linux GPIB.
//
//   write       UNT UNL [MTA] LAG        │ send    │ UNT UNL
//   read        UNT UNL TAG [MLA]        │ receive │ UNT UNL
//   serialPoll  UNT UNL SPE TAG [MLA]    │ receive │ SPD UNT UNL
//   clear       UNT UNL LAG SDC          │         │ UNT UNL
//   trigger     UNT UNL LAG LAG ... GET  │         │ UNT UNL
//   goToLocal   UNT UNL LAG GTL          │         │ UNT UNL
//
// LAG and TAG stand for the primary and, if there is one, the secondary address. After a failure
// recover() is called in place of the last column. If the last column itself fails, recover() is
// called, too, and the result is that of the columns before it.
//
// Threads  as GpibController.
// Source   IEEE 488.1; the manual's gpibSniff for the order UNT, UNL, TAG.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <mpf/drivers/gpib/gpib_controller.h>

namespace mpf {

class GpibBoardController : public GpibController {
 public:
  GpibResult write(const GpibAddress& to, Bytes data, bool sendEnd, Deadline deadline) final;
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits,
                      Deadline deadline) final;
  GpibResult sendCommands(Bytes commands, Deadline deadline) final;
  GpibPollResult serialPoll(const GpibAddress& at, Deadline deadline) final;
  GpibResult clearAll(Deadline deadline) final;
  GpibResult clear(const GpibAddress& at, Deadline deadline) final;
  GpibResult trigger(std::span<const GpibAddress> at, Deadline deadline) final;
  GpibResult localLockout(Deadline deadline) final;
  GpibResult goToLocal(const GpibAddress& at, Deadline deadline) final;

 protected:
  // Whether the board needs its own address among the commands (MTA, MLA) to send or to receive.
  enum class OwnAddress : std::uint8_t { implied, sent };

  //   own   primary address of the board, which no instrument may have
  explicit GpibBoardController(OwnAddress kind, std::uint8_t own = 0) : kind_(kind), own_(own) {}

  // --- the primitives
  // Sends bytes with ATN.
  virtual GpibResult command(Bytes commands, Deadline deadline) = 0;
  // Releases ATN and sends bytes, the last one with END when `sendEnd`.
  virtual GpibResult send(Bytes data, bool sendEnd, Deadline deadline) = 0;
  // Releases ATN and receives bytes.
  virtual GpibReadResult receive(const GpibReadLimits& limits, Deadline deadline) = 0;
  // After a failure: brings the bus back into a state in which the next operation works, within a
  // millisecond.
  //   closing  the commands that end the operation
  virtual void recover(Bytes closing) = 0;

 private:
  template <class Result>
  Result close(Result result, Bytes closing, Deadline deadline);
  GpibResult sendToListeners(std::span<const GpibAddress> at, std::uint8_t commandByte,
                             Deadline deadline);
  [[nodiscard]] GpibResult check(const GpibAddress& address) const;

  const OwnAddress kind_;
  const std::uint8_t own_;
};

}  // namespace mpf
