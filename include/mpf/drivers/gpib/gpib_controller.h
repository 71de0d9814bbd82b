// SPDX-License-Identifier: MIT
// GpibController: what each kind of controller (TI9914, Prologix, Linux GPIB, USBTMC) implements,
// and what GpibBus calls. Programs use GpibBus.
//
//   GpibBus ── one operation at a time ──► GpibController ──► chip, socket, device file
//           ◄── peeked bytes, service requests ──
//
// Each operation addresses the instruments that it concerns, and leaves the bus without talker and
// listeners. An operation that ends with another status than success has brought the bus back into
// a state in which the next operation works; if it could not, the next operation tries again.
//
// Threads  GpibBus calls the operations one at a time, from any thread. The handlers may be called
//          by any thread of the controller, one at a time.
// Crash    nothing here survives the process.
// Trust    gpib_types.h. No operation lasts longer than its deadline and a millisecond, unless
//          the kernel driver of the controller waits longer; the header of such a controller says
//          so.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf {

class GpibController {
 public:
  using Bytes = std::span<const std::uint8_t>;

  GpibController() = default;
  GpibController(const GpibController&) = delete;
  GpibController& operator=(const GpibController&) = delete;
  virtual ~GpibController() = default;

  // Sends `data`, the last byte with END when `sendEnd`.
  virtual GpibResult write(const GpibAddress& to, Bytes data, bool sendEnd, Deadline deadline) = 0;
  // Reads until one of `limits` or END.
  virtual GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits,
                              Deadline deadline) = 0;
  // Sends bytes with ATN, exactly these.
  virtual GpibResult sendCommands(Bytes commands, Deadline deadline) = 0;
  virtual GpibPollResult serialPoll(const GpibAddress& at, Deadline deadline) = 0;
  // Device clear (DCL) of all instruments.
  virtual GpibResult clearAll(Deadline deadline) = 0;
  // Selected device clear (SDC).
  virtual GpibResult clear(const GpibAddress& at, Deadline deadline) = 0;
  // Group execute trigger (GET) of these instruments at once; at least one.
  virtual GpibResult trigger(std::span<const GpibAddress> at, Deadline deadline) = 0;
  // IFC for at least 100 us; this controller is in charge of the bus afterwards.
  virtual GpibResult interfaceClear(Deadline deadline) = 0;
  // The REN line.
  virtual GpibResult remoteEnable(bool on, Deadline deadline) = 0;
  // Local lockout (LLO) of all instruments.
  virtual GpibResult localLockout(Deadline deadline) = 0;
  // Go to local (GTL) of one instrument.
  virtual GpibResult goToLocal(const GpibAddress& at, Deadline deadline) = 0;
  // Whether an instrument holds the SRQ line now. Empty: the controller could not tell.
  [[nodiscard]] virtual std::optional<bool> requestsService(Deadline deadline) = 0;

  // Calls `handler` soon after the SRQ line has become active. Empty: removes the handler, which
  // does not run after return.
  //   returns  whether the controller reports service requests; when it does not, GpibBus calls
  //            requestsService() periodically
  virtual bool onServiceRequest(std::function<void()> handler) = 0;
  // Shows the bytes of the bus to `handler`; empty: removes it. To be called between operations. A
  // controller that sees no commands (Prologix, USBTMC) shows the data only.
  virtual void onPeek(GpibPeekHandler handler) = 0;

  // For messages to people: the kind and the device, as "TI9914 a-ip488 (carrier ipac, site IP_a)".
  [[nodiscard]] virtual std::string description() const = 0;
};

}  // namespace mpf
