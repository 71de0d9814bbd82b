// SPDX-License-Identifier: MIT
// GpibInstrumentPort: connects a GpibInstrumentModel to the lines of a GpibBusModel: addresses,
// handshake, serial poll, remote and local.
//
//   commands with ATN ─► address ─┬─ listener ─► acceptor handshake ─► instrument.receive()
//                                 └─ talker ◄─── source handshake ◄─── instrument.nextByte()
//
// Threads  as GpibParticipant.
// Source   IEEE 488.1: AH, SH, T and TE, L and LE, SR, RL, DC, DT. Not modelled: parallel poll.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <mpf/drivers/gpib/gpib_types.h>

#include "drivers/gpib/acceptor.h"
#include "drivers/gpib/bus_participant.h"
#include "drivers/gpib/instrument_model.h"

namespace mpf {

class GpibInstrumentPort final : public GpibParticipant {
 public:
  GpibInstrumentPort(GpibAddress address, std::shared_ptr<GpibInstrumentModel> instrument);

  GpibLines follow(const GpibLines& seen) override;
  bool offer(const GpibLines& seen) override;

  [[nodiscard]] const GpibAddress& address() const noexcept { return address_; }
  // Simulates a fault: while false, it takes commands, but never a data byte.
  void setAccepts(bool accepts) noexcept { accepts_ = accepts; }
  // The state at power-up: without address, in local mode.
  void powerUp();

 private:
  using Control = GpibInstrumentModel::Control;
  // The primary address came, and the secondary address may follow.
  enum class Primary : std::uint8_t { none, listen, talk };

  void followControl(const GpibLines& seen);
  void followSource(const GpibLines& seen);
  bool take(const GpibLines& seen);
  void takeCommand(std::uint8_t command);
  void takeAddress(std::uint8_t command);
  void takeSecondary(std::uint8_t secondary);
  void listen();
  void talk();
  void executeAddressed(std::uint8_t command);
  void enter(Control control);
  [[nodiscard]] bool mayTalk(const GpibLines& seen) const noexcept;
  std::optional<GpibInstrumentModel::Byte> nextByte();

  const GpibAddress address_;
  const std::shared_ptr<GpibInstrumentModel> instrument_;
  bool accepts_ = true;

  GpibAcceptor acceptor_;
  Primary primary_ = Primary::none;
  bool isListener_ = false;
  bool isTalker_ = false;
  bool isPolled_ = false;  // serial poll: the talker sends its status byte
  bool isLockedOut_ = false;
  bool isRemoteEnabled_ = false;
  Control control_ = Control::local;
  std::optional<GpibInstrumentModel::Byte> waiting_;  // taken from the instrument, not accepted
  std::optional<GpibInstrumentModel::Byte> offered_;  // on the lines, with DAV
};

}  // namespace mpf
