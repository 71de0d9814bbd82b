// SPDX-License-Identifier: MIT
// MeterModel: a voltmeter as a model, which answers like an HP 3458A.
//
//   MeterModel meter;                      // usual address: 22
//   addressed to talk ──► "-8.874270409E-01" CR LF     a new reading each time
//   "ID?" LF          ──► "HP3458A" CR LF
//
//   command                  meaning
//   ID?                      name of the instrument
//   END OFF | ON | ALWAYS    whether answers end with EOI (or 0, 1, 2); ON means ALWAYS here
//   TRIG AUTO | HOLD | SGL   a reading whenever the controller reads; none; one now, then none
//   RQS n                    bits of the status byte that request service
//   SRQ                      sets bit 4 of the status byte
//   STB?                     status byte, as a number
//   CSB                      clears the status byte
//   ERRSTR?                  the last error, which it clears: 0,"NO ERROR"
//   RESET                    the state at power-up
//
// LF, ";" or EOI ends a command. A command discards the rest of an answer that was not read. GET
// takes a reading. DCL and SDC discard answers, pending commands and the status byte.
//
// Threads  as GpibInstrumentModel.
// Source   manual of the original MPF, gpibSniff: the readings; HP 3458A manual: commands, bits of
//          the status byte.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/gpib/instrument_model.h"

namespace mpf {

class MeterModel final : public GpibInstrumentModel {
 public:
  static constexpr std::uint8_t kUsualAddress = 22;

  // Bits of the status byte, besides kGpibRequestsService.
  enum StatusBit : std::uint8_t {
    kServiceCommand = 0x04,  // the command SRQ
    kReady = 0x10,  // always set
    kError = 0x20,
    kDataAvailable = 0x80,
  };
  using Volts = std::function<double()>;
  // The readings of the listing in the manual, again and again.
  [[nodiscard]] static Volts manualReadings();

  //   volts     what it measures
  //   sendsEnd  whether answers end with EOI at power-up; the instrument itself needs the command
  //             END ALWAYS first, which programs usually send
  explicit MeterModel(Volts volts = manualReadings(), bool sendsEnd = true);

  bool receive(std::uint8_t byte, bool end) override;
  std::optional<Byte> nextByte() override;
  [[nodiscard]] bool requestsService() const override { return isRequesting_; }
  std::uint8_t serialPoll() override;
  void clear() override;
  void trigger() override;

 private:
  enum class Trigger : std::uint8_t { automatic, hold };

  void execute(std::string_view command);
  void setEnd(std::string_view argument);
  void setTrigger(std::string_view argument);
  void setRequestMask(std::string_view argument);
  void answer(std::string text);
  void fail();
  void measure();
  void reset();
  [[nodiscard]] std::uint8_t status() const;
  void requestService(bool hadCause);
  [[nodiscard]] bool hasCause() const;

  const Volts volts_;
  const bool sendsEndAtPowerUp_;
  std::string command_;  // received so far
  std::string answer_;  // not sent yet
  bool hasError_ = false;
  Trigger trigger_ = Trigger::automatic;
  bool sendsEnd_;
  std::uint8_t requestMask_ = 0;
  bool hasServiceCommand_ = false;
  bool hasReading_ = false;  // answer_ is a reading of which nothing was sent
  bool isRequesting_ = false;
};

}  // namespace mpf
