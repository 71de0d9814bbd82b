// SPDX-License-Identifier: MIT
// PrologixModel: a Prologix controller as a model, at the far end of a line: a socket, or the
// master of a pseudo-terminal. Instruments (MeterModel) are on its bus.
//
//   PrologixModel model;
//   model.attach({22}, std::make_shared<MeterModel>());
//   model.connect(FileDescriptor(::accept4(...)));          // a new line replaces the former one
//   model.behave({.delay = 20ms, .garbage = "\xff"});       // faults
//
// Threads  any thread may call; the model has a thread of its own, which calls the instruments.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <mpf/file_descriptor.h>

#include "drivers/gpib/prologix_firmware_model.h"

namespace mpf {

class PrologixModel {
 public:
  // Faults; the default has none.
  struct Behaviour {
    std::string version = "Prologix GPIB-ETHERNET Controller version 01.06.06.00";
    bool hasRemoteEnable = false;  // ++ren
    std::chrono::milliseconds delay{0};  // before it executes a line
    // Sent before each line is executed.
    std::string garbage{};
    bool isSilent = false;  // receives, and executes nothing
    bool cutsConnection = false;  // instead of executing a line
  };

  PrologixModel();
  ~PrologixModel();
  PrologixModel(const PrologixModel&) = delete;
  PrologixModel& operator=(const PrologixModel&) = delete;

  // To be called before the first connect().
  void attach(const GpibAddress& address, std::shared_ptr<GpibInstrumentModel> instrument);
  void behave(Behaviour behaviour);
  // Serves `line` from now on. The lines that the former one did not execute are lost.
  void connect(FileDescriptor line);
  void hangUp() { connect(FileDescriptor()); }

 private:
  void run(const std::stop_token& stop);
  void takeNewLine();
  void receive();
  void execute(const PrologixFirmwareModel::Lines::Line& line);
  void send(std::string_view text);
  bool pause(std::chrono::milliseconds duration);
  [[nodiscard]] bool isCut() const;
  void wake() const noexcept;
  [[nodiscard]] Behaviour behaviour() const;

  FileDescriptor bell_;
  mutable std::mutex mutex_;
  Behaviour behaviour_;  // these three under mutex_
  FileDescriptor newLine_;
  bool hasNewLine_ = false;
  // used by the model's thread:
  FileDescriptor line_;
  PrologixFirmwareModel::Lines lines_;
  PrologixFirmwareModel firmware_;
  std::stop_token stop_;
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
