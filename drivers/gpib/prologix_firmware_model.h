// SPDX-License-Identifier: MIT
// PrologixFirmwareModel: what the firmware of a Prologix controller does with one line of input.
//
//   bytes ──► Lines: ends and escapes ──► execute(line) ──► send: answers, data
//                                              │
//                                              └─► instruments, by address
//
// It follows the manual of the GPIB-USB, which says that ++read <char> does not end with EOI. It
// gives up on an instrument that accepts no byte after ++read_tmo_ms; the manual names no time.
//
// Threads  one.
// Source   Prologix GPIB-USB user manual 6.107.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <mpf/drivers/gpib/gpib_types.h>

#include "drivers/gpib/instrument_model.h"

namespace mpf {

class PrologixFirmwareModel {
 public:
  // How the firmware reaches the line.
  struct Surroundings {
    std::function<void(std::string_view)> send;
    // Waits; returns false when the line was cut, and then the command ends.
    std::function<bool(std::chrono::milliseconds)> pause;
  };
  // Splits the input into lines, and removes escapes.
  class Lines {
   public:
    struct Line {
      std::string text;
      bool isCommand = false;
    };
    // Returns the line that ends with this byte. Empty lines are skipped.
    std::optional<Line> add(char byte);

   private:
    std::string text_;
    bool isEscaped_ = false;
    std::size_t plusSigns_ = 0;  // at the beginning, without an escape
  };

  explicit PrologixFirmwareModel(Surroundings surroundings)
      : surroundings_(std::move(surroundings)) {}
  void attach(const GpibAddress& address, std::shared_ptr<GpibInstrumentModel> instrument);
  void execute(const Lines::Line& line);

  std::string version = "Prologix GPIB-ETHERNET Controller version 01.06.06.00";
  bool hasRemoteEnable = false;  // ++ren

 private:
  using Words = std::vector<int>;
  using Command = void (PrologixFirmwareModel::*)(const Words&);
  [[nodiscard]] int* setting(std::string_view name);
  [[nodiscard]] Command command(std::string_view name) const;
  [[nodiscard]] GpibInstrumentModel* at(const GpibAddress& address) const;
  void executeCommand(std::string_view text);
  void transmit(std::string_view data);
  void receive(bool untilEnd, std::optional<int> untilByte);
  void answer(std::string_view text);
  void address(const Words& words);
  void clear(const Words& words);
  void local(const Words& words);
  void lockOut(const Words& words);
  void poll(const Words& words);
  void reportService(const Words& words);
  void trigger(const Words& words);
  void ignore(const Words& /*words*/) {}

  Surroundings surroundings_;
  std::map<GpibAddress, std::shared_ptr<GpibInstrumentModel>> instruments_;
  GpibAddress address_{};
  int auto_ = 1;
  int eoi_ = 1;
  int eos_ = 0;
  int eotChar_ = 0;
  int eotEnable_ = 0;
  int mode_ = 1;
  int readTimeoutMs_ = 200;
  int saveConfiguration_ = 1;
  int remoteEnable_ = 1;
};

}  // namespace mpf
