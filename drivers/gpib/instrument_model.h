// SPDX-License-Identifier: MIT
// GpibInstrumentModel: an instrument on a model of a GPIB bus. The same instruments stand behind
// the model of the bus with its handshake lines (TI9914), the model of a Prologix controller and
// the model of a USBTMC device.
//
//   bus ── receive(byte, end) ──► instrument: commands
//       ◄── nextByte() ─────────  instrument: answers
//       ── clear, trigger, remote, serialPoll ──►
//
// Threads  the bus model calls one function at a time.
#pragma once

#include <cstdint>
#include <optional>

namespace mpf {

class GpibInstrumentModel {
 public:
  struct Byte {
    std::uint8_t value = 0;
    bool end = false;  // sent with EOI
  };
  enum class Control : std::uint8_t { local, remote, remoteWithLockout };

  GpibInstrumentModel() = default;
  GpibInstrumentModel(const GpibInstrumentModel&) = delete;
  GpibInstrumentModel& operator=(const GpibInstrumentModel&) = delete;
  virtual ~GpibInstrumentModel() = default;

  // A data byte while the instrument is addressed to listen.
  //   returns  whether it was accepted; when not, the handshake stands still, and the same byte is
  //            offered again later
  virtual bool receive(std::uint8_t byte, bool end) = 0;
  // The next byte of the answer, which leaves the instrument with this call. Empty: the instrument
  // has nothing to say yet.
  virtual std::optional<Byte> nextByte() = 0;
  // Whether it holds the SRQ line.
  [[nodiscard]] virtual bool requestsService() const { return false; }
  // The status byte; the request for service ends with it.
  virtual std::uint8_t serialPoll() { return 0; }
  // DCL or SDC.
  virtual void clear() {}
  // GET.
  virtual void trigger() {}
  virtual void setControl(Control /*control*/) {}
};

}  // namespace mpf
